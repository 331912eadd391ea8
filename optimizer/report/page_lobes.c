#include "optimizer/report/page_lobes.h"
#include "base/angle.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/report/lobes/table_lamps.h"
#include "optimizer/report/page_pictures.h"
#include "optimizer/report/page_text.h"

#include <math.h>
#include <string.h>

enum { MOST_LAMPS = 24, WIDTH = 330, HEIGHT = 196, MIDDLE = WIDTH / 2, GROUND = HEIGHT - 22, RADIUS = 150 };
static const char *const lobe_color[] = {"#2457a6", "#c0392b", "#1e8449", "#8e44ad", "#b9770e", "#117a8b"};
enum { N_COLOR = sizeof lobe_color / sizeof lobe_color[0] };

/* Mean of the channels of a list of three numbers. */
static double level_of(const json_t *rgb)
{
    double sum = 0.0;
    for (size_t c = 0; c < 3; c++) sum += json_number_value(json_array_get(rgb, c));
    return sum / 3.0;
}

/* One lamp: its rows, and the lobes of these. */
struct lamp_page {
    const struct observation_set *o;
    const json_t *rows, *lobes;
    size_t i_row; /* the first row with that lamp */
    double most;  /* the radiance at the edge of the plot */
};

static bool has_lamp(const struct lamp_page *p, size_t i) { return table_lamp_row(p->o, i) == p->i_row; }

/* The first row of a lobe, by its name. */
static size_t row_of(const struct lamp_page *p, const json_t *lobe)
{
    size_t i = 0;
    while (i < p->o->n && strcmp(p->o->item[i].name, page_string(lobe, "row")) != 0) i++;
    return i;
}

/* Lobes grow without bound towards grazing angles, so the largest radiance of a row sets the scale. */
static void find_most(struct lamp_page *p)
{
    p->most = 0.0;
    for (size_t i = 0; i < p->o->n; i++) {
        const json_t *row = json_array_get(p->rows, i);
        if (!has_lamp(p, i)) continue;
        p->most = fmax(p->most, 1.25 * level_of(json_object_get(row, "measured")));
        p->most = fmax(p->most, 1.25 * level_of(json_object_get(row, "rendered")));
    }
}

static double x_at(const struct lamp_page *p, double theta_rad, double level)
{
    return MIDDLE + RADIUS * level / p->most * sin(theta_rad);
}

static double y_at(const struct lamp_page *p, double theta_rad, double level)
{
    return GROUND - RADIUS * level / p->most * cos(theta_rad);
}

static void text_at(double x, double y, const char *anchor, const char *text, FILE *out)
{
    fprintf(out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" font-size=\"10\" fill=\"#555\">%s</text>\n", x, y,
            anchor, text);
}

/* Half circles at the whole and the half of the largest radiance, rays every 30 degrees, and the lamp's direction. */
static void put_frame(const struct lamp_page *p, FILE *out)
{
    char text[32];
    for (int k = 1; k <= 2; k++) {
        const double r = RADIUS * k / 2.0;
        fprintf(out, "<path d=\"M%.1f %d A%.1f %.1f 0 0 1 %.1f %d\" fill=\"none\" stroke=\"#ccc\"/>\n", MIDDLE - r,
                (int)GROUND, r, r, MIDDLE + r, (int)GROUND);
        snprintf(text, sizeof text, "%.2g", p->most * k / 2.0);
        text_at(MIDDLE + r, GROUND + 13, "middle", text, out);
    }
    for (int deg = -90; deg <= 90; deg += 30)
        fprintf(out, "<line x1=\"%d\" y1=\"%d\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>\n", (int)MIDDLE, (int)GROUND,
                x_at(p, deg * RAD_PER_DEG, p->most), y_at(p, deg * RAD_PER_DEG, p->most));
    const double theta = -p->o->item[p->i_row].configuration.light_theta_rad;
    const double x = MIDDLE + (RADIUS + 12) * sin(theta), y = GROUND - (RADIUS + 12) * cos(theta);
    if (theta < -M_PI_2 || theta > M_PI_2) return; /* lit from behind */
    fprintf(out,
            "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#b9770e\" stroke-dasharray=\"4 3\"/>\n"
            "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"5\" fill=\"#f1c40f\" stroke=\"#b9770e\"/>\n",
            x, y, (double)MIDDLE, (double)GROUND, x, y);
}

/* The color of a lobe: lobes in the same plane have the same one. */
static const char *color_of(const struct lamp_page *p, size_t i)
{
    const double plane = table_camera_of(&p->o->item[i].configuration).plane_rad;
    size_t n = 0;
    for (size_t k = 0; k < i; k++) {
        if (!has_lamp(p, k) || table_lobe_row(p->o, k) != k) continue;
        const double other = table_camera_of(&p->o->item[k].configuration).plane_rad;
        if (fabs(other - plane) < 1e-6) return color_of(p, k);
        bool counted = false;
        for (size_t j = 0; j < k && !counted; j++)
            counted = has_lamp(p, j) && fabs(table_camera_of(&p->o->item[j].configuration).plane_rad - other) < 1e-6;
        n += !counted;
    }
    return lobe_color[n % N_COLOR];
}

static void put_lobe(const struct lamp_page *p, const json_t *lobe, FILE *out)
{
    const size_t i = row_of(p, lobe);
    size_t k;
    const json_t *rgb;
    if (i == p->o->n || !has_lamp(p, i)) return;
    fprintf(out, "<polyline fill=\"none\" stroke-width=\"1.6\" stroke=\"%s\" points=\"", color_of(p, i));
    json_array_foreach(json_object_get(lobe, "rendered"), k, rgb)
    {
        const double theta =
            RAD_PER_DEG * json_number_value(json_array_get(json_object_get(lobe, "camera_theta_deg"), k));
        if (level_of(rgb) > p->most) continue;
        fprintf(out, "%.1f,%.1f ", x_at(p, theta, level_of(rgb)), y_at(p, theta, level_of(rgb)));
    }
    fputs("\"/>\n", out);
}

static void put_measured(const struct lamp_page *p, size_t i, FILE *out)
{
    const struct observation *o = &p->o->item[i];
    const double theta = table_camera_of(&o->configuration).theta_rad,
                 level = level_of(json_object_get(json_array_get(p->rows, i), "measured"));
    const char *color = color_of(p, table_lobe_row(p->o, i));
    fprintf(out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.2\" stroke=\"%s\" stroke-width=\"1.4\" fill=\"%s\"><title>",
            x_at(p, theta, level), y_at(p, theta, level), color, o->set == JOB_SET_FIT ? color : "#fff");
    page_escaped(o->name, out);
    fprintf(out, ": measured %.4g, rendered %.4g</title></circle>\n", level,
            level_of(json_object_get(json_array_get(p->rows, i), "rendered")));
}

/* The planes of the lamp's lobes beside their colors. */
static void put_legend(const struct lamp_page *p, FILE *out)
{
    const char *seen[N_COLOR];
    size_t n = 0;
    for (size_t i = 0; i < p->o->n; i++) {
        if (!has_lamp(p, i) || table_lobe_row(p->o, i) != i) continue;
        const char *color = color_of(p, i);
        bool known = false;
        for (size_t k = 0; k < n; k++) known = known || seen[k] == color;
        if (known || n == N_COLOR) continue;
        seen[n++] = color;
        const double plane = table_camera_of(&p->o->item[i].configuration).plane_rad * DEG_PER_RAD;
        fprintf(out, "%s<span style=\"color:%s\">&#9644;</span> ", n > 1 ? ", " : "", color);
        if (plane < 0.01)
            fputs("plane of the lamp", out);
        else
            fprintf(out, "plane turned by %.3g&deg;", plane);
    }
}

static status put_lamp(const struct report *report, struct lamp_page *p, FILE *out, struct error *err)
{
    const struct configuration *c = &p->o->item[p->i_row].configuration;
    size_t k;
    const json_t *lobe;
    bool written;
    find_most(p);
    if (!(p->most > 0.0)) return STATUS_OK;
    fputs("<figure>", out);
    status s = page_picture_file(report, page_string(json_array_get(p->rows, p->i_row), "rendering_png"),
                                 "a sphere wrapped in the cloth", out, &written, err);
    fprintf(out,
            "<svg viewBox=\"0 0 %d %d\" width=\"%d\" role=\"img\">\n<title>radiance over the angle of the camera"
            "</title>\n",
            WIDTH, HEIGHT, WIDTH);
    put_frame(p, out);
    json_array_foreach(p->lobes, k, lobe) put_lobe(p, lobe, out);
    for (size_t i = 0; i < p->o->n; i++)
        if (has_lamp(p, i)) put_measured(p, i, out);
    fprintf(out, "</svg><figcaption><b>lamp %.3g&deg; / %.3g&deg;</b>: ", c->light_theta_rad * DEG_PER_RAD,
            c->light_phi_rad * DEG_PER_RAD);
    put_legend(p, out);
    fputs("</figcaption></figure>\n", out);
    return s;
}

status page_lobes(const struct report *report, const json_t *result, FILE *out, struct error *err)
{
    struct lamp_page p = {.o = &report->in.job->rows->observation,
                          .rows = json_object_get(result, "rows"),
                          .lobes = json_object_get(result, "lobes")};
    const size_t n_lamp = table_lamp_count(p.o);
    size_t n = 0;
    status s = STATUS_OK;
    fprintf(
        out,
        "<p>For each lamp: a sphere wrapped in the fitted cloth, seen along the normal of its middle, with the "
        "lamp on the left; and the radiance, as a mean of the channels, over the angle of the camera from the normal, "
        "to the right away from the lamp. Lines: rendered, as far as they fit; dots: measured, rings: held out. %zu of "
        "%zu lamps.</p>\n"
        "<div class=\"pictures lobes\">\n",
        n_lamp < MOST_LAMPS ? n_lamp : MOST_LAMPS, n_lamp);
    for (size_t i = 0; i < p.o->n && s == STATUS_OK && n < MOST_LAMPS; i++) {
        if (table_lamp_row(p.o, i) != i) continue;
        p.i_row = i;
        n++;
        s = put_lamp(report, &p, out, err);
    }
    fputs("</div>\n", out);
    return s;
}
