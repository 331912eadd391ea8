/* Films of described cloths: a film around a yarn has its width, turns and distance from the yarn, and lies flat on it;
 * a yarn that is a film alone lies flat in the cloth and goes on in the next tile; fibers are pushed out of films;
 * sequins are round and do not meet. */
#include "geometry/cloth/cloth.h"
#include "geometry/fibers/fiber_view.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double um = 1e-6;

static void set_number(struct cloth_description *d, const char *name, double value)
{
    const int i = cloth_number_index(d, name);
    assert_true(i >= 0);
    d->number[i].value = value;
}

/* A plain weave of two kinds, wefts of the second, which lie straight. */
static void describe(struct cloth_description *d, size_t n_weft_fiber, const struct cloth_film *film)
{
    assert_int_equal(cloth_description_init(d, "plain", NULL), STATUS_OK);
    d->n_kind = 2;
    d->kind[0].n_fiber = 7;
    d->kind[1] = d->kind[0];
    d->kind[1].n_fiber = n_weft_fiber;
    d->kind[1].film = *film;
    d->order[CLOTH_WEFT][0] = 1;
    d->n_yarn[CLOTH_WEFT] = d->n_yarn[CLOTH_WARP] = 4;
    cloth_description_number(d);
    set_number(d, "crimp", 1);
    set_number(d, "disorder", 0);
    set_number(d, "cover_warp", 0.4);
    if (n_weft_fiber > 0) set_number(d, "yarns[1].flatness", 1);
}

static void build(struct cloth_description *d, struct fiber_set *f)
{
    struct error err = {0};
    struct cloth_report r;
    fiber_set_init(f);
    if (cloth_description_check(d, &err) != STATUS_OK || cloth_build(d, NULL, NULL, NULL, f, &r, &err) != STATUS_OK)
        fail_msg("%s: %s", err.field, err.text);
    double low = INFINITY, z_max;
    fiber_set_z_range_m(f, &low, &z_max);
    assert_true(r.thickness_m > 0.0 && r.body_thickness_m > 0.0);
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void place(const struct fiber_set *f, size_t k, double p[3])
{
    for (size_t a = 0; a < 3; a++) p[a] = (double)f->position_m[3 * k + a];
}

static void test_film_around_a_yarn(void **state)
{
    (void)state;
    static const struct cloth_film film = {.width_um = 90, .thickness_um = 6, .wraps_per_m = 6000};
    struct cloth_description *d = malloc(sizeof *d);
    struct film_groups groups;
    struct fiber_set f;
    assert_non_null(d);
    describe(d, 19, &film);
    build(d, &f);
    cloth_film_groups(d, &groups);
    assert_true(groups.first_group == 2 && groups.n == 1 && cloth_film_group(d, 1) == 2);
    size_t n_film = 0;
    for (size_t i = 0; i < f.n_fiber; i++) {
        if (f.group[i] != 2) continue;
        const size_t first = f.first_vertex[i], last = f.first_vertex[i + 1] - 1;
        double middle[2] = {0, 0}, turned = 0, before = 0, radius_m = 0;
        n_film++;
        /* whole turns at even steps: their mean is the axis of the yarn */
        for (size_t k = first; k < last; k++)
            for (size_t a = 0; a < 2; a++) middle[a] += (double)f.position_m[3 * k + 1 + a] / (double)(last - first);
        for (size_t k = first; k <= last; k++) {
            const struct fiber_shape *s = &f.shape[k];
            double p[3], q[3], axis[3] = {(double)s->long_axis[0], (double)s->long_axis[1], (double)s->long_axis[2]};
            place(&f, k, p);
            const double out[3] = {0, p[1] - middle[0], p[2] - middle[1]}, angle = atan2(out[2], out[1]),
                         here_m = sqrt(dot(out, out));
            if (k > first) turned += remainder(angle - before, 2 * M_PI);
            before = angle;
            if (k == first) radius_m = here_m;
            assert_true(fabs(here_m / radius_m - 1) < 2e-3); /* steps of the mean: (turns / nodes)^2 */
            assert_true(fabs(2 * (double)s->radius * sqrt((double)s->ratio) / (90 * um) - 1) < 1e-4);
            assert_true(fabs(2 * (double)s->radius / sqrt((double)s->ratio) / (6 * um) - 1) < 1e-4);
            if (k == first || k == last) continue;
            place(&f, k + 1, q);
            const double along[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
            assert_true(fabs(dot(axis, out)) < 0.02 * here_m);                   /* flat on the yarn */
            assert_true(fabs(dot(axis, along)) < 0.2 * sqrt(dot(along, along))); /* half a step of 24 in a turn */
        }
        /* the core's section holds its fibers at their packing, and the film's middle lies half of it outside */
        const double core_m = 8 * um * sqrt(19 / 0.6);
        assert_true(fabs(radius_m / (core_m + 3 * um) - 1) < 2e-3);
        assert_true(fabs(turned / (2 * M_PI) - round(6000 * f.tile_size_m[0])) < 1e-3);
        assert_true(turned > 2 * 2 * M_PI);
    }
    assert_int_equal(n_film, 4);
    fiber_set_release(&f);
    free(d);
}

static void test_film_alone(void **state)
{
    (void)state;
    static const struct cloth_film film = {.width_um = 200, .thickness_um = 10};
    struct cloth_description *d = malloc(sizeof *d);
    struct fiber_set f;
    assert_non_null(d);
    describe(d, 0, &film);
    build(d, &f);
    assert_int_equal(cloth_n_fiber_kind(d), 1);
    size_t n_film = 0;
    for (size_t i = 0; i < f.n_fiber; i++) {
        if (f.group[i] != 1) continue;
        const size_t first = f.first_vertex[i], last = f.first_vertex[i + 1] - 1;
        double p[3], q[3];
        n_film++;
        place(&f, first, p);
        place(&f, last, q);
        assert_true(fabs(q[0] - p[0] - f.tile_size_m[0]) < 1e-9 && fabs(q[1] - p[1]) < 1e-9 &&
                    fabs(q[2] - p[2]) < 1e-9);
        for (size_t k = first; k <= last; k++)
            assert_true(fabsf(f.shape[k].long_axis[1]) > 0.999f && fabsf(f.shape[k].ratio - 20) < 1e-3f);
    }
    assert_int_equal(n_film, 4);
    fiber_set_release(&f);
    free(d);
}

/* Returns whether a point lies in a fiber of a group below n_group. */
static bool in_a_fiber(const struct fiber_set *f, size_t n_group, const double at[3])
{
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1] && f->group[i] < n_group; k++) {
            double p[3], q[3], to[3], along[3], off[3];
            place(f, k, p);
            place(f, k + 1, q);
            for (int a = 0; a < 3; a++) {
                to[a] = at[a] - p[a];
                if (a < 2) to[a] -= f->tile_size_m[a] * rint(to[a] / f->tile_size_m[a]);
                along[a] = q[a] - p[a];
            }
            const double share = fmin(fmax(dot(to, along) / dot(along, along), 0), 1),
                         radius_m = (double)f->radius_m[i];
            for (int a = 0; a < 3; a++) off[a] = to[a] - share * along[a];
            if (dot(off, off) < radius_m * radius_m) return true;
        }
    return false;
}

/* Share of the middle surface of the films of a group that lies in fibers. */
static double share_in_fibers(const struct fiber_set *f, size_t n_group, size_t group)
{
    enum { N_ACROSS = 12 };
    double area = 0, inside = 0;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1] && f->group[i] == group; k++) {
            const struct fiber_shape *s = &f->shape[k];
            double p[3], q[3], along[3], at[3];
            place(f, k, p);
            place(f, k + 1, q);
            for (int a = 0; a < 3; a++) along[a] = q[a] - p[a];
            for (int j = 0; j < N_ACROSS; j++) {
                const double u_m = (2 * (j + 0.5) / N_ACROSS - 1) * (double)s->radius * sqrt((double)s->ratio);
                for (int a = 0; a < 3; a++) at[a] = 0.5 * (p[a] + q[a]) + u_m * (double)s->long_axis[a];
                area += sqrt(dot(along, along));
                if (in_a_fiber(f, n_group, at)) inside += sqrt(dot(along, along));
            }
        }
    assert_true(area > 0);
    return inside / area;
}

/* The wefts of a dense twill are a yarn with a film around it, and a film alone: 0.04 and 0.11 of them lie in fibers,
 * 0.30 and 0.27 where fibers are pushed apart without regard to films. */
static void test_fibers_leave_films(void **state)
{
    (void)state;
    struct cloth_description *d = malloc(sizeof *d);
    struct fiber_set f;
    assert_non_null(d);
    assert_int_equal(cloth_description_init(d, "twill", NULL), STATUS_OK);
    d->n_kind = 3;
    d->kind[0].n_fiber = 24;
    d->kind[1] = d->kind[2] = d->kind[0];
    d->kind[1].n_fiber = 36;
    d->kind[1].film = (struct cloth_film){.width_um = 180, .thickness_um = 12, .wraps_per_m = 4500};
    d->kind[2].n_fiber = 0;
    d->kind[2].film = (struct cloth_film){.width_um = 250, .thickness_um = 15};
    d->n_order[CLOTH_WEFT] = 2;
    d->order[CLOTH_WEFT][0] = 1;
    d->order[CLOTH_WEFT][1] = 2;
    d->n_yarn[CLOTH_WEFT] = d->n_yarn[CLOTH_WARP] = 4;
    cloth_description_number(d);
    set_number(d, "crimp", 0.75);
    build(d, &f);
    for (size_t group = 2; group < 4; group++) {
        const double share = share_in_fibers(&f, 2, group);
        if (share > 0.15) fail_msg("film %zu: %.3f of its area lies in fibers", group - 2, share);
    }
    fiber_set_release(&f);
    free(d);
}

/* The planes of all discs are parallel without a spread of tilts, so two of them meet only where their planes are
 * nearer than they are thick. Neighbours in the next tiles count. */
static void test_sequins(void **state)
{
    (void)state;
    struct cloth_description *d = malloc(sizeof *d);
    struct fiber_set f;
    assert_non_null(d);
    assert_int_equal(cloth_description_init(d, "plain", NULL), STATUS_OK);
    d->sequins = (struct cloth_sequins){
        .diameter_um = 900, .thickness_um = 20, .spacing_um = 550, .row_spacing_um = 400, .tilt_deg = 15};
    build(d, &f);
    struct {
        double middle[3], normal[3];
    } disc[256];
    size_t n = 0;
    for (size_t i = 0; i < f.n_fiber; i++) {
        if (f.group[i] != 1) continue;
        const size_t first = f.first_vertex[i], last = f.first_vertex[i + 1] - 1;
        double p[3], q[3], area_m2 = 0, along[3];
        place(&f, first, p);
        place(&f, last, q);
        for (int a = 0; a < 3; a++) {
            disc[n].middle[a] = 0.5 * (p[a] + q[a]);
            along[a] = q[a] - p[a];
        }
        for (size_t k = first; k < last; k++) { /* the sections between vertices are as wide as their mean */
            double at[3], next[3], step2 = 0;
            place(&f, k, at);
            place(&f, k + 1, next);
            for (int a = 0; a < 3; a++) step2 += (next[a] - at[a]) * (next[a] - at[a]);
            const struct fiber_shape *s = &f.shape[k];
            area_m2 += sqrt(step2) * ((double)s[0].radius * sqrt((double)s[0].ratio) +
                                      (double)s[1].radius * sqrt((double)s[1].ratio));
        }
        assert_true(fabs(area_m2 / (M_PI * 450 * um * 450 * um) - 1) < 0.01);
        const float *axis = f.shape[(first + last) / 2].long_axis;
        for (int a = 0; a < 3; a++)
            disc[n].normal[a] =
                along[(a + 1) % 3] * (double)axis[(a + 2) % 3] - along[(a + 2) % 3] * (double)axis[(a + 1) % 3];
        const double length = sqrt(dot(disc[n].normal, disc[n].normal));
        for (int a = 0; a < 3; a++) disc[n].normal[a] /= disc[n].normal[2] < 0 ? -length : length;
        assert_true(fabs(disc[n].normal[2] - cos(15 * M_PI / 180)) < 1e-4);
        assert_true(++n < 256);
    }
    assert_true(n >= 6);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            for (int x = -1; x <= 1; x++)
                for (int y = -1; y <= 1; y++) {
                    if (i == j && x == 0 && y == 0) continue;
                    const double to[3] = {disc[j].middle[0] + x * f.tile_size_m[0] - disc[i].middle[0],
                                          disc[j].middle[1] + y * f.tile_size_m[1] - disc[i].middle[1],
                                          disc[j].middle[2] - disc[i].middle[2]};
                    if (dot(to, to) < 900 * um * 900 * um) assert_true(fabs(dot(to, disc[i].normal)) > 20 * um);
                }
    fiber_set_release(&f);
    free(d);
}

/* A film makes loops as wide as a yarn of its width. */
static void test_knitted_film(void **state)
{
    (void)state;
    struct cloth_description *d = malloc(sizeof *d);
    struct fiber_set yarn, film;
    assert_non_null(d);
    assert_int_equal(cloth_description_init(d, "jersey", NULL), STATUS_OK);
    d->n_kind = 1;
    d->kind[0].n_fiber = 16;
    d->n_yarn[CLOTH_WEFT] = d->n_yarn[CLOTH_WARP] = 2;
    cloth_description_number(d);
    build(d, &yarn);
    const double width_um = 2e6 * 8 * um * sqrt(16 / 0.6); /* of the yarn, at its radius and packing */
    d->kind[0].n_fiber = 0;
    d->kind[0].film = (struct cloth_film){.width_um = width_um, .thickness_um = 10};
    build(d, &film);
    for (int a = 0; a < 2; a++) assert_true(fabs(film.tile_size_m[a] / yarn.tile_size_m[a] - 1) < 1e-6);
    fiber_set_release(&yarn);
    fiber_set_release(&film);
    free(d);
}

/* A film 100 um wide along x, on a tile of 250 um, seen from above: flat, and turned by 60 degrees about its axis. */
static void test_films_from_above(void **state)
{
    (void)state;
    static const float turned[2][3] = {{0, 1, 0}, {0, 0.5f, 0.8660254f}};
    for (int i = 0; i < 2; i++) {
        struct fiber_set f;
        size_t size[2];
        uint8_t *grey = NULL;
        double cover;
        fiber_set_init(&f);
        assert_int_equal(fiber_set_reserve(&f, 1, 2, NULL), STATUS_OK);
        for (int a = 0; a < 2; a++) f.tile_size_m[a] = 250 * um;
        f.first_vertex[1] = 2;
        f.radius_m[0] = (float)(10 * um);
        assert_int_equal(fiber_set_add_shapes(&f, NULL), STATUS_OK);
        for (size_t k = 0; k < 2; k++) {
            const float p[3] = {(float)(250 * um * (double)k), (float)(125 * um), 0};
            memcpy(f.position_m + 3 * k, p, sizeof p);
            memcpy(f.shape[k].long_axis, turned[i], sizeof turned[i]);
            f.shape[k].ratio = 25; /* 50 by 2 um */
        }
        assert_int_equal(fiber_top_view(&f, um, size, &grey, &cover, NULL), STATUS_OK);
        assert_true(fabs(cover - (i == 0 ? 0.4 : 0.2)) < 2.0 / 250);
        if (i == 1) assert_true(grey[145 * 250 + 100] > grey[105 * 250 + 100]);
        free(grey);
        fiber_set_release(&f);
    }
}

static void refuse(struct cloth_description *d, const char *field)
{
    struct error err = {0};
    assert_int_equal(cloth_description_check(d, &err), STATUS_INVALID);
    assert_string_equal(err.field, field);
}

static void test_refused(void **state)
{
    (void)state;
    const struct cloth_film film = {.width_um = 200, .thickness_um = 10},
                            thick = {.width_um = 200, .thickness_um = 190};
    struct cloth_description *d = malloc(sizeof *d);
    assert_non_null(d);
    describe(d, 0, &film);
    d->order[CLOTH_WEFT][0] = 0;
    d->order[CLOTH_WARP][0] = 1;
    assert_int_equal(cloth_description_check(d, NULL), STATUS_OK);
    d->kind[0] = d->kind[1];
    d->kind[1].n_fiber = 5;
    refuse(d, "yarns[0].fibers");
    describe(d, 3, &thick);
    refuse(d, "yarns[1].film_width_um");
    d->kind[1].film.width_um = 0;
    d->sequins = (struct cloth_sequins){.diameter_um = 900, .thickness_um = 800};
    refuse(d, "sequin_diameter_um");
    free(d);
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_film_around_a_yarn),
                                      cmocka_unit_test(test_film_alone),
                                      cmocka_unit_test(test_fibers_leave_films),
                                      cmocka_unit_test(test_sequins),
                                      cmocka_unit_test(test_knitted_film),
                                      cmocka_unit_test(test_films_from_above),
                                      cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
