/* Filters of the rays of pixels on a screen that the lamp's axes cross askew: the whole sum, the four passes and the
 * axis-aligned filter against fine quadratures, the first two against each other, and what must be exact: constants,
 * other surfaces, slopes of both signs. */
#include "base/rng.h"
#include "renderer/preview/pixels/ray_filter.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 72, N_PIXEL = EDGE * EDGE };

/* Half planes that hide, or reflectors that are dark: where x + s y < at along an axis. */
struct half_plane {
    double slope, at;
    int axis;
};

struct scene {
    enum ray_window window;
    double half;
    double turn, cell[2]; /* of the screen against the axes, and x of a pixel along them */
    const struct half_plane *plane;
    size_t n_plane;
};

static const struct half_plane one[] = {{2.7e-4, 0.0, 0}}, two[] = {{2.7e-4, 2e-3, 0}, {6.3e-4, -1e-3, 1}},
                               behind[] = {{-3.1e-4, 1e-3, 1}}, wall[] = {{6.0, 0.4, 0}};
static const struct scene straight_one = {RAY_SQUARE, 50, 0, {2e-4, 2e-4}, one, 1},
                          straight_two = {RAY_SQUARE, 50, 0, {2e-4, 2e-4}, two, 2},
                          gaussian_straight = {RAY_GAUSSIAN, 50, 0, {2e-4, 2e-4}, two, 2},
                          square_one = {RAY_SQUARE, 50, 0.4, {2e-4, 2.6e-4}, one, 1},
                          square_two = {RAY_SQUARE, 50, 0.4, {2e-4, 2.6e-4}, two, 2},
                          gaussian_two = {RAY_GAUSSIAN, 50, 0.4, {2e-4, 2.6e-4}, two, 2},
                          gaussian_behind = {RAY_GAUSSIAN, 50, 0.9, {2e-4, 2.6e-4}, behind, 1},
                          above = {RAY_ABOVE, 5, 0.4, {0.25, 0.3}, wall, 1};

static bool hidden(const struct scene *s, const double x[2], const double y[2])
{
    for (size_t i = 0; i < s->n_plane; i++)
        if (x[s->plane[i].axis] + s->plane[i].slope * y[s->plane[i].axis] < s->plane[i].at) return true;
    return false;
}

/* x of a pixel: turned against the screen. */
static void x_of(const struct scene *s, double u, double v, double x[2])
{
    const double c = cos(s->turn), w = sin(s->turn);
    x[0] = s->cell[0] * (c * (u - EDGE / 2) + w * (v - EDGE / 2));
    x[1] = s->cell[1] * (-w * (u - EDGE / 2) + c * (v - EDGE / 2));
}

static void place(const struct scene *s, size_t i, struct ray_pixel *p)
{
    const double c = cos(s->turn), w = sin(s->turn), way[2][2] = {{c, w}, {-w, c}};
    double x[2];
    x_of(s, (double)(i % EDGE), (double)(i / EDGE), x);
    p->used = true;
    p->normal[2] = 1;
    p->depth_mm = 1;
    for (int a = 0; a < 2; a++) {
        const double longer = fmax(fabs(way[a][0]), fabs(way[a][1]));
        p->x[a] = (float)x[a];
        p->place_mm[a] = (float)x[a];
        p->axis[a][a] = 1;
        p->cell[a] = (float)(s->cell[a] / longer);
        for (int k = 0; k < 2; k++) p->step[a][k] = (float)(way[a][k] / longer);
    }
}

/* Rays of all pixels; slopes are known to 10 %. */
static void sample(const struct scene *s, size_t n_side, struct ray_field *f)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 17}, 0, 0);
    assert_int_equal(ray_field_init(f, EDGE, EDGE, n_side, 1, NULL), STATUS_OK);
    f->window = s->window;
    f->half = (float)s->half;
    for (size_t i = 0; i < N_PIXEL; i++) {
        struct ray_pixel *p = &f->pixel[i];
        double x[2];
        place(s, i, p);
        x_of(s, (double)(i % EDGE), (double)(i / EDGE), x);
        for (int a = 0; a < 2; a++) p->jitter[a] = (float)rng_double(&rng);
        for (size_t j = 0; j < n_side * n_side; j++) {
            const double y[2] = {(double)ray_field_y(f, p, 0, j % n_side), (double)ray_field_y(f, p, 1, j / n_side)};
            *ray_field_value(f, i, j % n_side, j / n_side) = hidden(s, x, y) ? 0 : 1;
            for (size_t k = 0; k < s->n_plane; k++) {
                const double along = x[s->plane[k].axis] + s->plane[k].slope * y[s->plane[k].axis];
                if (along >= s->plane[k].at && s->window != RAY_ABOVE) continue;
                ray_pixel_meet(p, (float)(0.9 * s->plane[k].slope));
                ray_pixel_meet(p, (float)(1.1 * s->plane[k].slope));
            }
        }
    }
    assert_int_equal(ray_field_smooth_slopes(f, NULL), STATUS_OK);
}

/* The mean of a pixel by 60 x 60 places. */
static double truth(const struct scene *s, size_t i)
{
    double sum = 0, all = 0, x[2];
    x_of(s, (double)(i % EDGE), (double)(i / EDGE), x);
    for (int k = 0; k < 60 * 60; k++) {
        const double u[2] = {(k % 60 + 0.5) / 30 - 1, (k / 60 + 0.5) / 30 - 1}, y[2] = {u[0] * s->half, u[1] * s->half},
                     square = 1 + y[0] * y[0] + y[1] * y[1];
        const double weight = s->window == RAY_SQUARE     ? 1
                              : s->window == RAY_GAUSSIAN ? exp(-2 * (u[0] * u[0] + u[1] * u[1]))
                                                          : 1 / (square * square);
        all += weight;
        if (!hidden(s, x, y)) sum += weight;
    }
    return sum / all;
}

enum { OWN, AXIS, WHOLE, PASSES, APART, N_ERROR };

/* Root mean squares over pixels whose filter lies on the screen. */
static void errors_of(const struct scene *s, size_t n_side, double error[N_ERROR])
{
    static const enum ray_filter_way way[4] = {RAY_OWN, RAY_AXIS, RAY_WHOLE, RAY_PASSES};
    static float mean[4][N_PIXEL];
    struct ray_field f;
    double count = 0;
    memset(error, 0, N_ERROR * sizeof *error);
    sample(s, n_side, &f);
    for (int k = 0; k < 4; k++) assert_int_equal(ray_filter(&f, way[k], NULL, NULL, mean[k], NULL), STATUS_OK);
    for (size_t y = RAY_REACH; y < EDGE - RAY_REACH; y++)
        for (size_t x = RAY_REACH; x < EDGE - RAY_REACH; x++, count++) {
            const size_t i = y * EDGE + x;
            const double right = truth(s, i), apart = (double)mean[2][i] - (double)mean[3][i];
            for (int k = 0; k < 4; k++) error[k] += pow((double)mean[k][i] - right, 2);
            error[APART] += apart * apart;
        }
    for (int k = 0; k < N_ERROR; k++) error[k] = sqrt(error[k] / count);
    ray_field_release(&f);
}

static void report(const char *name, const double e[N_ERROR])
{
    print_message("%s: own rays %.4f, by axes %.4f, whole %.4f, passes %.4f, whole and passes apart %.4f\n", name,
                  e[OWN], e[AXIS], e[WHOLE], e[PASSES], e[APART]);
}

/* On a grid along the lamp's edges, as the ground has it, nine tenths of the noise go away. */
static void shadows_on_a_grid_are_near_their_quadratures(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        const struct scene *scene;
        size_t n_side;
    } row[] = {{"grid, square lamp, one half plane", &straight_one, 4},
               {"grid, square lamp, two", &straight_two, 4},
               {"grid, Gaussian lamp, two", &gaussian_straight, 4},
               {"grid, square lamp, 2 x 2 rays", &straight_one, 2}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        double e[N_ERROR];
        errors_of(row[i].scene, row[i].n_side, e);
        report(row[i].name, e);
        assert_true(e[WHOLE] < 0.1 * e[OWN] && e[PASSES] < 0.1 * e[OWN] && e[APART] < 0.008);
    }
}

/* The published filter takes more than ten times fewer rays than a pixel's own, whose error falls at least as the
 * root: it must be below a third of theirs. Passes and the whole sum differ by bins
 * of the lamp, an eighth of its half side, and by neighbours that lie up to half a pixel beside the axis. */
static void shadows_are_near_their_quadratures(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        const struct scene *scene;
        double apart;
    } row[] = {{"square lamp, one half plane", &square_one, 0.008},
               {"square lamp, two", &square_two, 0.008},
               {"Gaussian lamp, two", &gaussian_two, 0.008},
               {"lens, behind the focus", &gaussian_behind, 0.008}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        double e[N_ERROR];
        errors_of(row[i].scene, 4, e);
        report(row[i].name, e);
        assert_true(e[WHOLE] < e[OWN] / 3 && e[PASSES] < e[OWN] / 3 && e[AXIS] < e[OWN]);
        assert_true(e[APART] < row[i].apart);
    }
}

static void light_of_a_reflector_is_near_its_quadrature(void **state)
{
    (void)state;
    double e[N_ERROR];
    errors_of(&above, 4, e);
    report("reflector", e);
    assert_true(e[WHOLE] < e[OWN] / 2 && e[PASSES] < e[OWN] / 2 && e[APART] < 0.02);
}

static void a_constant_stays(void **state)
{
    (void)state;
    static const enum ray_filter_way way[4] = {RAY_OWN, RAY_AXIS, RAY_WHOLE, RAY_PASSES};
    static float mean[N_PIXEL];
    const struct scene *const scene[3] = {&square_two, &gaussian_two, &above};
    for (int k = 0; k < 3; k++) {
        struct ray_field f;
        sample(scene[k], 4, &f);
        for (size_t i = 0; i < N_PIXEL * 16; i++) f.value[i] = 0.75f;
        for (int w = 0; w < 4; w++) {
            assert_int_equal(ray_filter(&f, way[w], NULL, NULL, mean, NULL), STATUS_OK);
            for (size_t i = 0; i < N_PIXEL; i++) assert_true(fabsf(mean[i] - 0.75f) < 1e-4f);
        }
        ray_field_release(&f);
    }
}

/* Left of the middle the surface looks up and is white, right of it it looks aside and is black: nothing crosses. */
static void other_surfaces_are_left_out(void **state)
{
    (void)state;
    static const enum ray_filter_way way[3] = {RAY_AXIS, RAY_WHOLE, RAY_PASSES};
    static float mean[N_PIXEL];
    struct ray_field f;
    sample(&square_two, 4, &f);
    for (size_t i = 0; i < N_PIXEL; i++) {
        const bool left = i % EDGE < EDGE / 2;
        f.pixel[i].normal[0] = left ? 0 : 1;
        f.pixel[i].normal[2] = left ? 1 : 0;
        for (size_t j = 0; j < 16; j++) f.value[i * 16 + j] = left ? 1 : 0;
    }
    for (int w = 0; w < 3; w++) {
        assert_int_equal(ray_filter(&f, way[w], NULL, NULL, mean, NULL), STATUS_OK);
        for (size_t i = 0; i < N_PIXEL; i++) assert_true(fabsf(mean[i] - (i % EDGE < EDGE / 2 ? 1.0f : 0.0f)) < 1e-5f);
    }
    ray_field_release(&f);
}

/* Around the plane in focus there is no shear: pixels keep their own rays. Pixels that have met nothing, too. */
static void pixels_without_a_shear_keep_their_rays(void **state)
{
    (void)state;
    static float own[N_PIXEL], mean[N_PIXEL];
    struct ray_field f;
    sample(&gaussian_two, 4, &f);
    for (size_t i = 0; i < N_PIXEL; i++) {
        f.pixel[i].slope[0] = i % 2 == 0 ? -1e-4f : 0;
        f.pixel[i].slope[1] = i % 2 == 0 ? 2e-4f : 0;
    }
    assert_int_equal(ray_filter(&f, RAY_OWN, NULL, NULL, own, NULL), STATUS_OK);
    assert_int_equal(ray_filter(&f, RAY_PASSES, NULL, NULL, mean, NULL), STATUS_OK);
    assert_memory_equal(own, mean, sizeof own);
    ray_field_release(&f);
}

static void threads_do_not_change_the_bits(void **state)
{
    (void)state;
    static float alone[N_PIXEL], pooled[N_PIXEL];
    struct ray_field f;
    struct thread_pool *pool;
    assert_int_equal(thread_pool_new(3, &pool, NULL), STATUS_OK);
    sample(&square_two, 3, &f);
    assert_int_equal(ray_filter(&f, RAY_PASSES, NULL, NULL, alone, NULL), STATUS_OK);
    assert_int_equal(ray_filter(&f, RAY_PASSES, pool, NULL, pooled, NULL), STATUS_OK);
    assert_memory_equal(alone, pooled, sizeof alone);
    ray_field_release(&f);
    thread_pool_free(pool);
    struct error err = {0};
    assert_int_equal(ray_field_init(&f, EDGE, EDGE, RAY_MAX_SIDE + 1, 1, &err), STATUS_INVALID);
    ray_field_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shadows_on_a_grid_are_near_their_quadratures),
        cmocka_unit_test(shadows_are_near_their_quadratures),
        cmocka_unit_test(light_of_a_reflector_is_near_its_quadrature),
        cmocka_unit_test(a_constant_stays),
        cmocka_unit_test(other_surfaces_are_left_out),
        cmocka_unit_test(pixels_without_a_shear_keep_their_rays),
        cmocka_unit_test(threads_do_not_change_the_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
