/* The pictures of docs/described-cloth.md: described cloths, drawn fiber by fiber (shaded, not traced).
 *
 *   cloth_pictures weaves FILE.png     every named weave with its default numbers, plies, a draft, melange
 *   cloth_pictures numbers FILE.png     what numbers do: each row is a number at three values
 *
 * Kinds of yarn differ in colour: undyed, blue, red. A panel shows the same length of cloth in every column of a row.
 */
#include "base/angle.h"
#include "geometry/cloth/cloth.h"
#include "renderer/image/image.h"
#include "tests/support/tiny_text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PANEL = 140, TITLE = 18, GAP = 6, COLUMNS = 3 };

/* One panel: a weave, changes of its description, and the number that is shown. */
struct sample {
    const char *title, *weave;
    const char *draft[8];
    size_t n_kind, n_fiber, n_ply;
    bool melange;            /* kind 0 with kind 1 */
    const char *warp, *weft; /* kinds as digits; NULL: 0 */
    struct {
        const char *name;
        double value;
    } set[4];
    double camera_theta_deg;
    double crop_m; /* 0: half of the tile */
};

static const struct sample weave_sample[] = {
    {.title = "plain", .weave = "plain"},
    {.title = "twill", .weave = "twill", .n_kind = 2, .warp = "1"},
    {.title = "twill31", .weave = "twill31", .n_kind = 2, .warp = "1"},
    {.title = "satin", .weave = "satin"},
    {.title = "basket", .weave = "basket", .n_kind = 2, .warp = "1"},
    {.title = "rib", .weave = "rib"},
    {.title = "jersey", .weave = "jersey"},
    {.title = "velvet", .weave = "velvet", .n_fiber = 20, .set = {{"yarns[0].fiber_radius_um", 6}}},
    {.title = "felt", .weave = "felt"},
    {.title = "two plies", .weave = "plain", .n_fiber = 40, .n_ply = 2, .set = {{"yarns[0].ply_twist_per_m", -900}}},
    {.title = "draft, stripes",
     .draft = {"110100", "101001", "010011", "001110", "011010", "100101"},
     .n_kind = 3,
     .warp = "001122",
     .weft = "0"},
    {.title = "melange", .weave = "twill", .n_kind = 2, .melange = true, .set = {{"yarns[0].melange", 0.35}}},
};

/* The first entry of `set` is the number that is shown, at the three values. */
static const struct {
    const char *name, *weave;
    double value[COLUMNS];
    struct sample like;
} number_row[] = {
    {"cover_warp", "plain", {0.6, 0.85, 1.2}, {.n_kind = 2, .warp = "1"}},
    {"crimp", "plain", {0.1, 0.5, 0.9}, {.n_kind = 2, .warp = "1", .camera_theta_deg = 50}},
    {"compression", "plain", {0.6, 0.9, 1.2}, {.camera_theta_deg = 60}},
    {"disorder", "twill", {0, 0.04, 0.12}, {.n_kind = 2, .warp = "1"}},
    {"yarns[0].packing", "plain", {0.35, 0.55, 0.8}, {.n_kind = 1}},
    {"yarns[0].flatness", "plain", {1.6, 2.4, 4}, {.camera_theta_deg = 50}},
    {"yarns[0].twist_per_m", "satin", {-1500, 0, 1500}, {.n_kind = 1}},
    {"yarns[0].migration", "satin", {0, 0.2, 0.5}, {.n_kind = 1}},
    {"yarns[0].fiber_angle_deg", "satin", {0, 5, 20}, {.n_kind = 1}},
    {"yarns[0].radius_spread", "satin", {0, 0.15, 0.4}, {.n_kind = 1}},
    {"yarns[0].hairs_per_mm", "plain", {0, 10, 40}, {.camera_theta_deg = 50}},
    {"nap_tilt_deg", "plain", {0, 45, 70}, {.set = {{NULL, 0}, {"yarns[0].hairs_per_mm", 40}}}},
    {"pile_tilt_deg", "velvet", {0, 25, 60}, {.camera_theta_deg = 50}},
    {"density", "felt", {0.05, 0.15, 0.3}, {.camera_theta_deg = 30}},
    {"tilt_spread_deg", "felt", {0, 15, 50}, {.camera_theta_deg = 30}},
    {"layering", "felt", {0, 0.5, 1}, {.camera_theta_deg = 30}},
};

static void set_order(struct cloth_description *d, enum cloth_direction direction, const char *kinds)
{
    if (kinds == NULL) return;
    d->n_order[direction] = strlen(kinds);
    for (size_t i = 0; kinds[i] != '\0'; i++) d->order[direction][i] = (uint8_t)(kinds[i] - '0');
}

static status describe(const struct sample *s, struct cloth_description *d, struct error *err)
{
    size_t n_row = 0;
    status st = cloth_description_init(d, s->weave != NULL ? s->weave : "plain", err);
    while (n_row < 8 && s->draft[n_row] != NULL) n_row++;
    if (st == STATUS_OK && n_row > 0) st = cloth_description_draft(d, s->draft, n_row, err);
    if (st != STATUS_OK) return st;
    if (s->n_fiber > 0) d->kind[0].n_fiber = s->n_fiber;
    if (s->n_ply > 0) d->kind[0].n_ply = s->n_ply;
    for (size_t k = 1; k < s->n_kind; k++) d->kind[k] = d->kind[0];
    if (s->n_kind > 0) d->n_kind = s->n_kind;
    if (s->melange) d->kind[0].melange_with = 1;
    set_order(d, CLOTH_WARP, s->warp);
    set_order(d, CLOTH_WEFT, s->weft);
    cloth_description_number(d);
    for (size_t i = 0; i < 4 && s->set[i].name != NULL; i++) {
        int at = cloth_number_index(d, s->set[i].name);
        if (at < 0) return error_set(err, STATUS_INVALID, "%s has no number '%s'", s->weave, s->set[i].name);
        d->number[at].value = s->set[i].value;
    }
    return cloth_description_check(d, err);
}

/* What is drawn of one panel: the topmost fiber at each pixel, seen at an angle from the normal. */
struct panel {
    double crop_m, cosine, sine; /* of that angle; the camera is on the side of -y */
    float depth[PANEL * PANEL];
    uint8_t rgb[PANEL * PANEL * 3];
};

/* Shading of a fiber along the unit vector d: a diffuse part and a highlight after Kajiya and Kay 1989. across: place
 * across the fiber, -1..1. */
static void shade(const double d[3], const struct panel *w, double across, double height, int kind, uint8_t rgb[3])
{
    static const double colour[CLOTH_MAX_KIND][3] = {
        {0.88, 0.82, 0.70}, {0.27, 0.40, 0.66}, {0.72, 0.27, 0.22}, {0.34, 0.60, 0.38}};
    const double light[3] = {-0.41, 0.41, 0.81}, view[3] = {0.0, -w->sine, w->cosine};
    double to_light = 0.0, to_view = 0.0;
    for (int a = 0; a < 3; a++) {
        to_light += d[a] * light[a];
        to_view += d[a] * view[a];
    }
    double diffuse = sqrt(fmax(0.0, 1.0 - to_light * to_light));
    double mirror = diffuse * sqrt(fmax(0.0, 1.0 - to_view * to_view)) - to_light * to_view;
    double round = sqrt(fmax(0.0, 1.0 - across * across)), highlight = 0.4 * pow(fmax(0.0, mirror), 24.0) * round;
    for (int k = 0; k < 3; k++) {
        double value = height * (colour[kind][k] * (0.2 + 0.65 * diffuse * round) + highlight);
        rgb[k] = (uint8_t)(17 * lround(15.0 * pow(fmin(1.0, value), 1.0 / 1.8))); /* few levels: small files */
    }
}

static void draw_disc(struct panel *w, const double p[3], double radius_m, const double d[3], double height, int kind)
{
    double pixel_m = w->crop_m / PANEL, x = p[0] / pixel_m, y = (p[1] * w->cosine + p[2] * w->sine) / pixel_m;
    double r = radius_m / pixel_m, side[2] = {-d[1], d[0]}, length = fmax(1e-9, hypot(d[0], d[1]));
    for (long j = (long)floor(y - r); j <= (long)ceil(y + r); j++)
        for (long i = (long)floor(x - r); i <= (long)ceil(x + r); i++) {
            double u = (double)i + 0.5 - x, v = (double)j + 0.5 - y;
            if (i < 0 || j < 0 || i >= PANEL || j >= PANEL || u * u + v * v > r * r) continue;
            double near_m = p[2] * w->cosine - p[1] * w->sine + pixel_m * sqrt(r * r - u * u - v * v);
            size_t at = (size_t)((PANEL - 1 - j) * PANEL + i);
            if (near_m <= (double)w->depth[at]) continue;
            w->depth[at] = (float)near_m;
            shade(d, w, (u * side[0] + v * side[1]) / length / fmax(r, 1e-9), height, kind, w->rgb + 3 * at);
        }
}

/* Draws one fiber and those of its images in the neighbouring tiles that are seen. */
static void draw_fiber(struct panel *w, const struct fiber_set *f, size_t i, double thickness_m)
{
    for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
        const float *a = f->position_m + 3 * k;
        double d[3], length = 0.0;
        for (int x = 0; x < 3; x++) d[x] = (double)a[3 + x] - (double)a[x];
        length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        if (!(length > 0.0)) continue;
        size_t n = (size_t)ceil(length / (0.5 * w->crop_m / PANEL));
        for (int x = 0; x < 3; x++) d[x] /= length;
        for (size_t s = 0; s < n; s++)
            for (int tile = 0; tile < 16; tile++) {
                double at = length * (double)s / (double)n,
                       p[3] = {(double)a[0] + at * d[0] + (double)(tile % 4 - 1) * f->tile_size_m[0],
                               (double)a[1] + at * d[1] + (double)(tile / 4 - 1) * f->tile_size_m[1],
                               (double)a[2] + at * d[2]};
                double height = 0.35 + 0.65 * fmin(1.0, p[2] / thickness_m);
                draw_disc(w, p, f->radius_m[i], d, height, f->group[i]);
            }
    }
}

static void draw(const struct fiber_set *f, const struct cloth_report *r, const struct sample *s, struct panel *w)
{
    double theta = RAD_PER_DEG * s->camera_theta_deg;
    w->crop_m = s->crop_m;
    w->cosine = cos(theta);
    w->sine = sin(theta);
    memset(w->rgb, 24, sizeof w->rgb);
    for (size_t i = 0; i < PANEL * PANEL; i++) w->depth[i] = -INFINITY;
    for (size_t i = 0; i < f->n_fiber; i++) draw_fiber(w, f, i, r->thickness_m);
}

struct sheet {
    uint8_t *rgb;
    size_t width, height;
    struct thread_pool *pool;
};

/* Renders a sample and puts it at (column, row). *crop_m: shown length; 0 chooses half of the tile. */
static status put_panel(struct sheet *t, const struct sample *given, size_t column, size_t row, double *crop_m,
                        struct error *err)
{
    struct sample s = *given;
    struct cloth_description d;
    struct cloth_report r;
    struct fiber_set f;
    struct panel *w = malloc(sizeof *w);
    fiber_set_init(&f);
    status st = w != NULL ? describe(&s, &d, err) : STATUS_NO_MEMORY;
    if (st == STATUS_OK) st = cloth_build(&d, NULL, t->pool, NULL, &f, &r, err);
    if (st == STATUS_OK && *crop_m == 0.0) *crop_m = 0.5 * fmin(r.tile_m[0], r.tile_m[1]);
    s.crop_m = *crop_m;
    if (st == STATUS_OK) draw(&f, &r, &s, w);
    size_t x0 = column * (PANEL + GAP), y0 = row * (PANEL + TITLE + GAP);
    if (st == STATUS_OK) tiny_text_draw(t->rgb, t->width, t->height, x0, y0 + 4, 1, s.title);
    for (size_t i = 0; i < PANEL * PANEL && st == STATUS_OK; i++)
        memcpy(t->rgb + 3 * ((y0 + TITLE + i / PANEL) * t->width + x0 + i % PANEL), w->rgb + 3 * i, 3);
    free(w);
    fiber_set_release(&f);
    return st;
}

static status put_weave(struct sheet *t, size_t i, struct error *err)
{
    double crop_m = 0.0;
    char title[16];
    struct sample s = weave_sample[i];
    snprintf(title, sizeof title, "%zu", i + 1);
    s.title = title;
    return put_panel(t, &s, i % COLUMNS, i / COLUMNS, &crop_m, err);
}

static status put_numbers(struct sheet *t, size_t row, struct error *err)
{
    double crop_m = 0.0;
    status st = STATUS_OK;
    for (size_t i = 0; i < COLUMNS && st == STATUS_OK; i++) {
        size_t column = (i + 1) % COLUMNS; /* the middle value first: it chooses the length that is shown */
        struct sample s = number_row[row].like;
        char title[64];
        snprintf(title, sizeof title, "%zu  %g", row + 1, number_row[row].value[column]);
        s.weave = number_row[row].weave;
        s.title = title;
        s.set[0].name = number_row[row].name;
        s.set[0].value = number_row[row].value[column];
        st = put_panel(t, &s, column, row, &crop_m, err);
    }
    return st;
}

int main(int argc, char **argv)
{
    bool weaves = argc >= 3 && strcmp(argv[1], "weaves") == 0, numbers = argc >= 3 && strcmp(argv[1], "numbers") == 0;
    if (!weaves && !numbers) {
        fprintf(stderr, "cloth_pictures weaves|numbers FILE.png \n");
        return 2;
    }
    size_t n = weaves ? sizeof weave_sample / sizeof *weave_sample : sizeof number_row / sizeof *number_row;
    size_t n_row = weaves ? (n + COLUMNS - 1) / COLUMNS : n;
    struct sheet t = {
        .width = COLUMNS * (PANEL + GAP) - GAP,
        .height = n_row * (PANEL + TITLE + GAP) - GAP,
    };
    struct error err = {0};
    t.rgb = malloc(3 * t.width * t.height);
    status st = t.rgb != NULL ? thread_pool_new(0, &t.pool, &err) : STATUS_NO_MEMORY;
    if (t.rgb != NULL) memset(t.rgb, 255, 3 * t.width * t.height);
    for (size_t i = 0; i < n && st == STATUS_OK; i++) st = (weaves ? put_weave : put_numbers)(&t, i, &err);
    if (st == STATUS_OK) st = image_write_png_rgb8(t.rgb, t.width, t.height, argv[2], &err);
    if (st != STATUS_OK) fprintf(stderr, "%s\n", err.text);
    thread_pool_free(t.pool);
    free(t.rgb);
    return st == STATUS_OK ? 0 : 1;
}
