/* A film around a yarn covers as much of its core as a ribbon wound around a cylinder.
 *
 * Points uniform on the core with directions by their cosine are the ends of rays from outside, as many from each
 * direction as the core shows of itself. By symmetry such a ray crosses a cylinder about the core at a uniform place.
 * The share of rays that meet a thin ribbon of the width w and the pitch p on a cylinder of the radius R first is
 * therefore its share of the cylinder, w sqrt(p^2 + (2 pi R)^2) / (2 pi R p), or 1 where turns overlap. */
#include "base/rng.h"
#include "geometry/cloth/cloth.h"
#include "renderer/scene/scene.h"
#include "renderer/scene/scene_place.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_RAY = 30000, GROUP_FILM = 2 };
#define MM 1e3 /* a metre in millimetres */

/* The core's axis runs along x at (y, z). */
struct wrapped {
    struct scene *scene;
    double y_m, z_m, core_m, ribbon_m, tile_m, pitch_m;
};

/* The film of a straight weft of 19 fibers of 8 um, around a solid core in their place. */
static void wrap(const struct cloth_film *film, struct wrapped *w)
{
    struct cloth_description *d = malloc(sizeof *d);
    struct fiber_set f, alone;
    struct error err = {0};
    assert_non_null(d);
    assert_int_equal(cloth_description_init(d, "plain", NULL), STATUS_OK);
    d->n_kind = 2;
    d->kind[0].n_fiber = 7;
    d->kind[1] = d->kind[0];
    d->kind[1].n_fiber = 19;
    d->kind[1].film = *film;
    d->order[CLOTH_WEFT][0] = 1;
    d->n_yarn[CLOTH_WEFT] = d->n_yarn[CLOTH_WARP] = 4;
    cloth_description_number(d);
    const struct {
        const char *name;
        double value;
    } number[] = {{"crimp", 1}, {"disorder", 0}, {"cover_warp", 0.4}, {"yarns[1].flatness", 1}};
    for (size_t k = 0; k < sizeof number / sizeof *number; k++)
        d->number[cloth_number_index(d, number[k].name)].value = number[k].value;
    fiber_set_init(&f);
    fiber_set_init(&alone);
    if (cloth_build(d, NULL, NULL, NULL, &f, NULL, &err) != STATUS_OK) fail_msg("%s", err.text);
    size_t i = 0;
    while (f.group[i] != GROUP_FILM) i++;
    const size_t first = f.first_vertex[i], n = f.first_vertex[i + 1] - first;
    w->tile_m = f.tile_size_m[0];
    w->core_m = 8e-6 * sqrt(19 / 0.6); /* packing */
    w->ribbon_m = w->core_m + 0.5e-6 * film->thickness_um;
    w->pitch_m = w->tile_m / round(film->wraps_per_m * w->tile_m);
    assert_int_equal(fiber_set_reserve(&alone, 2, n + 2, NULL), STATUS_OK);
    alone.tile_size_m[0] = w->tile_m;
    alone.tile_size_m[1] = 40 * w->core_m;
    memcpy(alone.position_m, f.position_m + 3 * first, 3 * n * sizeof *f.position_m);
    double middle[2] = {0, 0}; /* whole turns at even steps */
    for (size_t k = 0; k + 1 < n; k++)
        for (size_t a = 0; a < 2; a++) middle[a] += (double)alone.position_m[3 * k + 1 + a] / (double)(n - 1);
    const float axis[2][3] = {{0, (float)middle[0], (float)middle[1]},
                              {(float)w->tile_m, (float)middle[0], (float)middle[1]}};
    memcpy(alone.position_m + 3 * n, axis, sizeof axis);
    alone.first_vertex[1] = n;
    alone.first_vertex[2] = n + 2;
    alone.group[0] = 1;
    alone.radius_m[0] = f.radius_m[i];
    alone.radius_m[1] = (float)(0.97 * w->core_m); /* within the chords of the film's turns */
    assert_int_equal(fiber_set_add_shapes(&alone, NULL), STATUS_OK);
    memcpy(alone.shape, f.shape + first, n * sizeof *f.shape);
    w->y_m = middle[0];
    const struct film_groups films = {1, 1, {{.color = {1, 1, 1}, .roughness = 0.3f}}};
    if (scene_new(&alone, &(struct scene_option){.films = &films}, &w->scene, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    struct scene_segment core;
    scene_segment_at(w->scene, (uint32_t)scene_n_segment(w->scene) - 1, &core);
    w->z_m = (double)core.middle_mm[2] / MM;
    fiber_set_release(&f);
    fiber_set_release(&alone);
    free(d);
}

/* A ray from outside that ends at a random place of the core. */
static void draw_ray(const struct wrapped *w, struct rng *rng, struct scene_ray *ray)
{
    const double radius_m = 0.97 * w->core_m, at = 2 * M_PI * rng_double(rng), turn = 2 * M_PI * rng_double(rng),
                 sine = sqrt(rng_double(rng)), cosine = sqrt(1 - sine * sine);
    const double x_m = w->tile_m * rng_double(rng);
    /* out along the normal, x, and around the core */
    const double out[3] = {sine * cos(turn), cosine * cos(at) - sine * sin(turn) * sin(at),
                           cosine * sin(at) + sine * sin(turn) * cos(at)};
    /* back to where the ray is three radii from the axis */
    const double across2 = out[1] * out[1] + out[2] * out[2], b = radius_m * cosine,
                 t = (sqrt(b * b + across2 * 8 * radius_m * radius_m) - b) / across2;
    const double from_mm[3] = {MM * (x_m + t * out[0]), MM * (w->y_m + radius_m * cos(at) + t * out[1]),
                               MM * (w->z_m + radius_m * sin(at) + t * out[2])},
                 back[3] = {-out[0], -out[1], -out[2]};
    assert_true(scene_ray_enter(w->scene, from_mm, back, ray));
}

static double share_of_film(const struct wrapped *w)
{
    const struct rng_key key = {.seed = 5};
    struct rng rng;
    size_t n_film = 0;
    rng_start(&rng, &key, 0, 0);
    for (size_t k = 0; k < N_RAY; k++) {
        struct scene_ray ray;
        struct scene_hit hit;
        draw_ray(w, &rng, &ray);
        assert_true(scene_trace(w->scene, &ray, &hit));
        n_film += scene_film(w->scene, hit.i_segment) != NULL;
        if (scene_film(w->scene, hit.i_segment) != NULL) continue;
        /* the core is where the rays suppose it */
        const double y = (double)hit.position_mm[1] + ray.offset_mm[1] - MM * w->y_m,
                     z = (double)hit.position_mm[2] - MM * w->z_m;
        assert_true(fabs(hypot(y, z) / (0.97 * MM * w->core_m) - 1) < 1e-3);
    }
    return (double)n_film / N_RAY;
}

static void test_cover(void **state)
{
    (void)state;
    /* bias: of the share, at most. The film is flat across its path, so its edges are (w cos psi / 2)^2 / (2 R) above
     * the cylinder, psi the angle of path and axis: seen from the core they are nearer to each other by the share
     * (w cos psi / (2 R))^2 / 3. The rounded edges add (thickness / w)^2 ln(w / thickness) of it. */
    static const struct {
        struct cloth_film film;
        double bias;
    } is[] = {{{.width_um = 30, .thickness_um = 2, .wraps_per_m = 6000}, 0.02},
              {{.width_um = 60, .thickness_um = 2, .wraps_per_m = -6000}, 0.02},
              {{.width_um = 30, .thickness_um = 2, .wraps_per_m = 18000}, 0.02},
              {{.width_um = 180, .thickness_um = 6, .wraps_per_m = 6000}, 1e-3}};
    for (size_t i = 0; i < sizeof is / sizeof *is; i++) {
        struct wrapped w;
        wrap(&is[i].film, &w);
        const double around_m = 2 * M_PI * w.ribbon_m, p_m = fabs(w.pitch_m),
                     ribbon = 1e-6 * is[i].film.width_um * hypot(p_m, around_m) / (around_m * p_m),
                     cover = fmin(ribbon, 1), got = share_of_film(&w), se = sqrt(cover * (1 - cover) / N_RAY);
        print_message("ribbon %.4f: covered %.4f +- %.4f\n", ribbon, got, se);
        assert_true(fabs(got - cover) < 3.5 * se + is[i].bias * cover);
        scene_free(w.scene);
    }
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_cover)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
