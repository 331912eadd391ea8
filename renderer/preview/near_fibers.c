#include "renderer/preview/near_fibers.h"

#include "renderer/preview/direction_grid.h"
#include "renderer/scene/scene_place.h"
#include "renderer/transport/surface/parameter_sets.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OPEN_CELLS = NEAR_OPEN_EDGE * NEAR_OPEN_EDGE, TASK_POINTS = 64, MOST_COARSER = 6, LOBE_VIEWS = 8 };

/* In radii: how far a line may leave its fiber, and the longest way between two of its points. */
static const double deviation_radii = 0.15, step_radii = 8.0, coarser = 1.6;

void near_fibers_release(struct near_fibers *f)
{
    free(f->point);
    free(f->lobe);
    memset(f, 0, sizeof *f);
}

/* ---- lines ---- */

static void set_point(const struct scene *scene, uint32_t i_segment, int end, size_t n_set, struct near_point *p)
{
    struct scene_segment segment;
    scene_segment_at(scene, i_segment, &segment);
    memset(p, 0, sizeof *p);
    for (int a = 0; a < 3; a++)
        p->position_mm[a] = segment.middle_mm[a] + ((float)end - 0.5f) * segment.length_mm * segment.tangent[a];
    p->radius_mm = segment.radius_mm;
    p->i_set = (uint32_t)scene_set_of(scene, i_segment, n_set);
}

static double distance2(const float a[3], const float b[3])
{
    double sum = 0.0;
    for (int k = 0; k < 3; k++) sum += ((double)a[k] - (double)b[k]) * ((double)a[k] - (double)b[k]);
    return sum;
}

/* Whether every point between a and b lies within `most` of the straight line from a to b. */
static bool is_straight(const struct near_point *a, const struct near_point *b, double most)
{
    const double length2 = distance2(a->position_mm, b->position_mm);
    for (const struct near_point *p = a + 1; p < b; p++) {
        double along = 0.0;
        for (int k = 0; k < 3; k++)
            along += (double)(p->position_mm[k] - a->position_mm[k]) * (double)(b->position_mm[k] - a->position_mm[k]);
        const double off2 = distance2(p->position_mm, a->position_mm) - along * along / fmax(length2, 1e-18);
        if (off2 > most * most) return false;
    }
    return true;
}

/* All points of the scene's lines. Segments follow each other along a fiber. */
static status take_points(const struct scene *scene, size_t n_set, struct near_fibers *f, struct error *err)
{
    const size_t n = scene_n_segment(scene);
    f->point = malloc((2 * n + 1) * sizeof *f->point);
    if (f->point == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot take the fibers of the twin: out of memory");
    for (size_t i = 0; i < n; i++) {
        struct near_point first, *last = f->point + f->n_point - 1;
        set_point(scene, (uint32_t)i, 0, n_set, &first);
        const bool goes_on =
            i > 0 && scene_fiber_of(scene, (uint32_t)i) == scene_fiber_of(scene, (uint32_t)i - 1) &&
            distance2(first.position_mm, last->position_mm) < 1e-4 * (double)first.radius_mm * (double)first.radius_mm;
        if (i > 0) last->is_last = !goes_on;
        if (!goes_on) f->point[f->n_point++] = first;
        set_point(scene, (uint32_t)i, 1, n_set, &f->point[f->n_point++]);
    }
    if (n > 0) f->point[f->n_point - 1].is_last = true;
    return STATUS_OK;
}

/* Leaves out points that are not needed at `scale` times the limits. Points move towards the front, never past those
 * that are still to be read. */
static void thin_out(struct near_fibers *f, double scale)
{
    size_t n = 0, from = 0;
    for (size_t i = 0; i < f->n_point; i++) {
        bool keep = i == 0 || f->point[i - 1].is_last || f->point[i].is_last;
        if (!keep) {
            const double radius = (double)f->point[i].radius_mm, step = scale * step_radii * radius;
            keep = distance2(f->point[from].position_mm, f->point[i + 1].position_mm) > step * step ||
                   !is_straight(&f->point[from], &f->point[i + 1], scale * deviation_radii * radius);
        }
        if (!keep) continue;
        from = i;
        f->point[n++] = f->point[i];
    }
    f->n_point = n;
}

/* Leaves out segments whose two ends see nothing. */
static void leave_out_hidden(struct near_fibers *f)
{
    size_t n = 0;
    for (size_t i = 0; i < f->n_point; i++) {
        struct near_point p = f->point[i];
        const bool is_open = (p.open[0] | p.open[1]) != 0;
        const bool after =
            i > 0 && !f->point[i - 1].is_last && (f->point[i - 1].open[0] | f->point[i - 1].open[1]) != 0;
        const bool before = !p.is_last && (f->point[i + 1].open[0] | f->point[i + 1].open[1]) != 0;
        if (!is_open && !after && !before) continue;
        /* the line ends here if the next segment is hidden; what is written lies before what is still to be read */
        if (!is_open && !before) p.is_last = true;
        f->point[n++] = p;
    }
    f->n_point = n;
}

/* ---- visibility ---- */

struct open_work {
    const struct scene *scene;
    struct near_fibers *f;
    size_t n_side;
    float direction[2][OPEN_CELLS][3];
};

static void open_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct open_work *w = context;
    for (size_t i = i_task * TASK_POINTS; i < (i_task + 1) * TASK_POINTS && i < w->f->n_point; i++) {
        struct near_point *p = &w->f->point[i];
        for (size_t side = 0; side < 2; side++) {
            p->open[side] = 0;
            for (size_t k = 0; side < w->n_side && k < OPEN_CELLS; k++) {
                struct scene_ray ray = {.inside = true, .i_from = SCENE_NO_SEGMENT};
                memcpy(ray.origin_mm, p->position_mm, sizeof ray.origin_mm);
                ray.origin_mm[2] += side == 0 ? p->radius_mm : -p->radius_mm;
                memcpy(ray.direction, w->direction[side][k], sizeof ray.direction);
                if (!scene_occluded(w->scene, &ray)) p->open[side] |= (uint64_t)1 << k;
            }
        }
    }
}

static status find_open(const struct scene *scene, struct near_fibers *f, struct thread_pool *pool,
                        const struct progress *progress)
{
    struct open_work w = {.scene = scene, .f = f, .n_side = scene_has_black_sheet(scene) ? 1 : 2};
    for (size_t side = 0; side < 2; side++)
        for (size_t k = 0; k < OPEN_CELLS; k++) {
            const double square[2] = {((double)(k % NEAR_OPEN_EDGE) + 0.5) / NEAR_OPEN_EDGE,
                                      ((double)(k / NEAR_OPEN_EDGE) + 0.5) / NEAR_OPEN_EDGE};
            double d[3];
            direction_grid_direction(square, side, d);
            for (int a = 0; a < 3; a++) w.direction[side][k][a] = (float)d[a];
        }
    return thread_pool_run(pool, (f->n_point + TASK_POINTS - 1) / TASK_POINTS, open_task, &w, progress);
}

/* ---- lobes ---- */

static void fiber_direction_at(double theta, double phi, float d[3])
{
    d[0] = (float)sin(theta);
    d[1] = (float)(cos(theta) * cos(phi));
    d[2] = (float)(cos(theta) * sin(phi));
}

/* S at the middle of a cell, in the mean of LOBE_VIEWS views of the fiber. */
static void lobe_cell(const struct parameter_sets *sets, size_t i_set, size_t cell, float rgb[3])
{
    const double x = 2.0 * ((double)(cell % NEAR_LOBE_HALF) + 0.5) / NEAR_LOBE_HALF - 1.0,
                 half = copysign(0.5 * M_PI * x * x, x),
                 differ = M_PI *
                          (((double)(cell / NEAR_LOBE_HALF % NEAR_LOBE_DIFFERENCE) + 0.5) / NEAR_LOBE_DIFFERENCE - 0.5),
                 azimuth = M_PI * ((double)(cell / (NEAR_LOBE_HALF * NEAR_LOBE_DIFFERENCE)) + 0.5) / NEAR_LOBE_AZIMUTH,
                 most = 0.4999 * M_PI;
    memset(rgb, 0, 3 * sizeof *rgb);
    for (int k = 0; k < LOBE_VIEWS; k++) {
        const double view = scattering_view_azimuth_rad(sets->model, k, LOBE_VIEWS);
        float wi[3], wo[3], s[3];
        fiber_direction_at(fmin(fmax(half - differ, -most), most), view + azimuth, wi);
        fiber_direction_at(fmin(fmax(half + differ, -most), most), view, wo);
        sets->model->eval(sets->state[i_set], wi, wo, s, NULL);
        for (int c = 0; c < 3; c++) rgb[c] += s[c] / LOBE_VIEWS;
    }
}

static status make_lobes(const struct radiance_input *in, struct near_fibers *f, struct error *err)
{
    struct parameter_sets sets = {0};
    status s = parameter_sets_init(&sets, in->scene.fibers, in->model->surface, in->param, in->n_set, err);
    if (s == STATUS_OK) {
        f->lobe = malloc(f->n_set * NEAR_LOBE_CELLS * 3 * sizeof *f->lobe);
        if (f->lobe == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot make lobes: out of memory");
    }
    for (size_t i = 0; s == STATUS_OK && i < f->n_set * NEAR_LOBE_CELLS; i++)
        lobe_cell(&sets, i / NEAR_LOBE_CELLS, i % NEAR_LOBE_CELLS, f->lobe + 3 * i);
    parameter_sets_release(&sets);
    return s;
}

status near_fibers_make(const struct radiance_input *in, size_t most_points, struct thread_pool *pool,
                        const struct progress *progress, struct near_fibers *f, struct error *err)
{
    memset(f, 0, sizeof *f);
    f->n_set = in->n_set > 1 ? in->n_set : 1;
    status s = make_lobes(in, f, err);
    if (s == STATUS_OK) s = take_points(in->scene.fibers, f->n_set, f, err);
    double scale = 1.0;
    if (s == STATUS_OK) thin_out(f, scale);
    if (s == STATUS_OK && find_open(in->scene.fibers, f, pool, progress) != STATUS_OK)
        s = error_set(err, STATUS_CANCELLED, "taking the fibers of the twin was cancelled");
    if (s == STATUS_OK) leave_out_hidden(f);
    for (int i = 0; s == STATUS_OK && f->n_point > most_points && i < MOST_COARSER; i++) thin_out(f, scale *= coarser);
    if (f->n_point > most_points) f->n_point = 0;
    if (s != STATUS_OK) near_fibers_release(f);
    return s;
}
