#include "geometry/grade/scan_grade.h"

#include "geometry/grade/grade_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* N_PLACE: places of the profile to a neighbour; N_RING, N_AROUND: rings of places around an axis and places of each;
 * N_NEAR: fibers that are considered there. Points are a quarter of a diameter apart. */
enum { N_PLACE = 9, N_RING = 4, N_AROUND = 6, N_NEAR = 24, POINTS_PER_WINDOW = 4 * GRADE_WINDOW_DIAMETERS };
/* Radius of the last ring in radii of the fiber, and width of a blurred edge in voxels. */
static const double PATCH_RADII = 1.6, EDGE_VOXEL = 2.0;
/* Distances of neighbours in sums of radii: nearer ones are the same fiber, farther ones have others between. */
static const double LEAST_APART = 0.5, MOST_APART = 1.6;
/* Two lines that are nearer, in sums of radii, may be one fiber; lines of touching fibers have 1. */
static const double DOUBLE_APART = 0.8;
/* Least density of a fiber that its contrast is compared with. */
static const double LEAST_LEVEL = 0.25;

const char *grade_verdict_name(enum grade_verdict v)
{
    static const char *const name[] = {"none", "resolved", "partly", "unresolved"};
    return name[v];
}

/* Points of one fiber, first .. first + n. */
struct window {
    size_t first, n;
    double double_share; /* of the points that have another line too near */
    bool is_beside;
    double depth, contrast;
};

/* Sums for the slope of measured on expected densities; middle, n_middle: measured at half the radius and within. */
struct slope {
    double n, x, y, xx, xy, middle, n_middle;
};

struct grade_job {
    const struct volume *v;
    struct grade_points points;
    struct window *window;
    size_t n_window;
};

/* Adds the densities on the way from p by `way`. */
static void add_profile(const struct volume *v, const float p[3], const double way[3], double weight,
                        double profile[N_PLACE])
{
    for (int k = 0; k < N_PLACE; k++) {
        double x[3];
        for (int a = 0; a < 3; a++) x[a] = (double)p[a] + way[a] * k / (N_PLACE - 1);
        profile[k] += weight * grade_density_at(v, x);
    }
}

/* Returns the distance of the neighbour q in sums of the radii. */
static double add_beside(const struct grade_job *j, const struct grade_point *p, const struct grade_point *q,
                         double profile[N_PLACE])
{
    double way[3], along = 0.0;
    for (int a = 0; a < 3; a++) along += ((double)q->p[a] - (double)p->p[a]) * (double)p->t[a];
    for (int a = 0; a < 3; a++) way[a] = (double)q->p[a] - (double)p->p[a] - along * (double)p->t[a];
    add_profile(j->v, p->p, way, 1.0, profile);
    return hypot(hypot(way[0], way[1]), way[2]) / (j->points.radius[p->fiber] + j->points.radius[q->fiber]);
}

/* Density at x if the scan shows the fibers: those near are full discs with blurred edges. */
static double expected_at(const struct grade_job *j, const struct grade_point *const *near, size_t n, const double x[3])
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        const struct grade_point *q = near[i];
        double along = 0.0, d2 = 0.0;
        for (int a = 0; a < 3; a++) {
            double d = x[a] - (double)q->p[a];
            along += d * (double)q->t[a];
            d2 += d * d;
        }
        double inside = (j->points.radius[q->fiber] - sqrt(fmax(0.0, d2 - along * along))) / EDGE_VOXEL;
        sum += fmax(0.0, fmin(1.0, 0.5 + inside));
    }
    return fmin(1.0, sum);
}

/* Two unit vectors across a direction. */
static void across(const float t[3], double e[3], double o[3])
{
    double norm = 0.0;
    int least = 0;
    for (int a = 1; a < 3; a++)
        if (fabsf(t[a]) < fabsf(t[least])) least = a;
    for (int a = 0; a < 3; a++) {
        e[a] = (a == least ? 1.0 : 0.0) - (double)t[least] * (double)t[a];
        norm += e[a] * e[a];
    }
    for (int a = 0; a < 3; a++) e[a] /= sqrt(norm);
    for (int a = 0; a < 3; a++)
        o[a] = (double)t[(a + 1) % 3] * e[(a + 2) % 3] - (double)t[(a + 2) % 3] * e[(a + 1) % 3];
}

/* Adds the densities at the axis and on rings around it. */
static void add_patch(const struct grade_job *j, size_t i_point, struct slope *s)
{
    const struct grade_point *p = &j->points.point[i_point], *near[N_NEAR];
    const double outer = PATCH_RADII * j->points.radius[p->fiber];
    size_t n = grade_points_near(&j->points, i_point, outer + 0.5 * EDGE_VOXEL, near, N_NEAR);
    double e[3], o[3];
    across(p->t, e, o);
    for (int ring = 0; ring <= N_RING; ring++)
        for (int k = 0; k < (ring == 0 ? 1 : N_AROUND); k++) {
            double angle = 2.0 * M_PI * (k + 0.5 * (ring % 2)) / N_AROUND, away = outer * ring / N_RING, x[3];
            for (int a = 0; a < 3; a++) x[a] = (double)p->p[a] + away * (cos(angle) * e[a] + sin(angle) * o[a]);
            double expected = expected_at(j, near, n, x), measured = grade_density_at(j->v, x);
            s->n += 1.0;
            s->x += expected;
            s->y += measured;
            s->xx += expected * expected;
            s->xy += expected * measured;
            s->middle += ring <= 1 ? measured : 0.0;
            s->n_middle += ring <= 1 ? 1.0 : 0.0;
        }
}

/* Slope over the density of the fiber, which need not be 1. 0 where the expected densities are all the same, because no
 * scan could show the fibers there. */
static double contrast_of(const struct slope *s)
{
    const double var = s->xx - s->x * s->x / s->n, least = 1e-4 * s->n;
    const double level = fmin(1.0, fmax(LEAST_LEVEL, s->middle / s->n_middle));
    return var > least ? (s->xy - s->x * s->y / s->n) / var / level : 0.0;
}

static double highest(const double *x, int from, int to)
{
    double most = x[from];
    for (int k = from + 1; k <= to; k++) most = fmax(most, x[k]);
    return most;
}

static double lowest(const double *x, int from, int to)
{
    double least = x[from];
    for (int k = from + 1; k <= to; k++) least = fmin(least, x[k]);
    return least;
}

/* The ridge need not lie on the axis, because a fiber may be hollow. */
static double depth_of(const double p[N_PLACE])
{
    const int last = N_PLACE - 1;
    double ridge = 0.5 * (highest(p, 0, 2) + highest(p, last - 2, last));
    return ridge > 0.0 ? 1.0 - lowest(p, 3, last - 3) / ridge : 0.0;
}

static void grade_window(void *context, size_t i_task, size_t i_thread)
{
    struct grade_job *j = context;
    struct window *w = &j->window[i_task];
    struct slope slope = {0};
    double profile[N_PLACE] = {0.0};
    size_t n_beside = 0, n_double = 0;
    (void)i_thread;
    scratch_keep_within(j->v->space);
    for (size_t i = w->first; i < w->first + w->n; i++) {
        const struct grade_point *q = grade_points_beside(&j->points, i, LEAST_APART, MOST_APART);
        if (q != NULL) n_double += add_beside(j, &j->points.point[i], q, profile) < DOUBLE_APART;
        n_beside += q != NULL;
        add_patch(j, i, &slope);
    }
    w->is_beside = 2 * n_beside >= w->n;
    w->depth = depth_of(profile);
    w->double_share = (double)n_double / (double)w->n;
    w->contrast = contrast_of(&slope);
}

/* Cuts the points of every fiber into windows of about equal length. */
static status make_windows(struct grade_job *j, const struct fiber_set *f, struct error *err)
{
    size_t n = 0;
    for (size_t i = 0; i < f->n_fiber; i++) n += (j->points.first[i + 1] - j->points.first[i]) / POINTS_PER_WINDOW + 1;
    j->window = calloc(n + 1, sizeof *j->window);
    if (j->window == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    for (size_t i = 0; i < f->n_fiber; i++) {
        size_t first = j->points.first[i], n_point = j->points.first[i + 1] - first;
        size_t n_part = (n_point + POINTS_PER_WINDOW / 2) / POINTS_PER_WINDOW;
        if (n_point > 0 && n_part == 0) n_part = 1;
        for (size_t k = 0; k < n_part; k++) {
            size_t from = n_point * k / n_part, to = n_point * (k + 1) / n_part;
            j->window[j->n_window++] = (struct window){.first = first + from, .n = to - from};
        }
    }
    return STATUS_OK;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Medians of the depth beside neighbours and of the contrast. */
static status medians(const struct grade_job *j, struct scan_grade *grade, struct error *err)
{
    double *depth = malloc((j->n_window + 1) * sizeof *depth), *contrast = malloc((j->n_window + 1) * sizeof *contrast);
    size_t n = 0;
    if (depth == NULL || contrast == NULL) {
        free(depth);
        free(contrast);
        return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    }
    for (size_t i = 0; i < j->n_window; i++) {
        if (j->window[i].is_beside) depth[n++] = j->window[i].depth;
        contrast[i] = j->window[i].contrast;
    }
    qsort(depth, n, sizeof *depth, ascending);
    qsort(contrast, j->n_window, sizeof *contrast, ascending);
    grade->valley_depth = n > 0 ? depth[n / 2] : NAN;
    grade->contrast = j->n_window > 0 ? contrast[j->n_window / 2] : NAN;
    free(depth);
    free(contrast);
    return STATUS_OK;
}

/* Adds up lengths; a point stands for half a radius of its fiber. */
static void sum_lengths(const struct grade_job *j, struct scan_grade *grade, float *safe)
{
    double all = 0.0, beside = 0.0, sure = 0.0, doubled = 0.0;
    for (size_t i = 0; i < j->n_window; i++) {
        const struct window *w = &j->window[i];
        size_t fiber = j->points.point[w->first].fiber;
        double length = (double)w->n * j->points.radius[fiber];
        all += length;
        beside += w->is_beside ? length : 0.0;
        doubled += w->double_share * length;
        if (w->contrast < GRADE_SAFE_CONTRAST) continue;
        sure += length;
        if (safe != NULL)
            safe[fiber] += (float)((double)w->n / (double)(j->points.first[fiber + 1] - j->points.first[fiber]));
    }
    grade->beside_share = all > 0.0 ? beside / all : NAN;
    grade->safe_share = all > 0.0 ? sure / all : NAN;
    grade->double_share = all > 0.0 ? doubled / all : NAN;
    grade->verdict = !(all > 0.0)                                 ? GRADE_NONE
                     : grade->safe_share >= GRADE_RESOLVED_SHARE  ? GRADE_RESOLVED
                     : grade->safe_share < GRADE_UNRESOLVED_SHARE ? GRADE_UNRESOLVED
                                                                  : GRADE_PARTLY;
}

/* Measures all windows. The caller releases the points and the windows also after an error. */
static status grade_windows(struct grade_job *j, const struct fiber_set *f, struct thread_pool *pool,
                            const struct progress *progress, struct error *err)
{
    status s = grade_points_make(&j->points, f, j->v->voxel_size_m[0], MOST_APART, err);
    if (s == STATUS_OK) s = make_windows(j, f, err);
    if (s != STATUS_OK) return s;
    s = thread_pool_run(pool, j->n_window, grade_window, j, progress);
    return s == STATUS_OK ? s : error_set(err, s, "grading the scan was cancelled");
}

static void grade_job_release(struct grade_job *j)
{
    free(j->window);
    grade_points_release(&j->points);
}

status scan_grade_measure(const struct volume *v, const struct fiber_set *f, struct thread_pool *pool,
                          const struct progress *progress, struct scan_grade *grade, float *safe, struct error *err)
{
    struct grade_job j = {.v = v};
    *grade = (struct scan_grade){.valley_depth = NAN, .contrast = NAN, .score = NAN};
    for (size_t i = 0; i < f->n_fiber && safe != NULL; i++) safe[i] = 0.0f;
    status s = grade_windows(&j, f, pool, progress, err);
    if (s == STATUS_OK) sum_lengths(&j, grade, safe);
    if (s == STATUS_OK) s = medians(&j, grade, err);
    grade_job_release(&j);
    return s;
}

/* The vertices of a fiber lie between its points, which are half a radius apart (grade_points.h). */
static void contrast_of_fiber(const struct grade_job *j, const struct fiber_set *f, size_t fiber,
                              const struct window *w, const struct window *end, float *contrast)
{
    double at = 0.0, apart_m = 0.5 * (double)f->radius_m[fiber];
    for (size_t i = f->first_vertex[fiber]; i < f->first_vertex[fiber + 1]; i++) {
        const float *p = f->position_m + 3 * i;
        if (i > f->first_vertex[fiber])
            at += hypot(hypot((double)(p[0] - p[-3]), (double)(p[1] - p[-2])), (double)(p[2] - p[-1]));
        size_t point = j->points.first[fiber] + (size_t)(at / apart_m);
        while (w + 1 < end && point >= w->first + w->n) w++;
        contrast[i] = w < end ? (float)w->contrast : NAN;
    }
}

status scan_grade_contrast(const struct volume *v, const struct fiber_set *f, struct thread_pool *pool,
                           const struct progress *progress, float *contrast, struct error *err)
{
    struct grade_job j = {.v = v};
    status s = grade_windows(&j, f, pool, progress, err);
    const struct window *w = j.window, *end = w;
    for (size_t i = 0; i < f->n_fiber && s == STATUS_OK; i++, w = end) {
        while (end < j.window + j.n_window && j.points.point[end->first].fiber == i) end++;
        contrast_of_fiber(&j, f, i, w, end, contrast);
    }
    grade_job_release(&j);
    return s;
}

/* Appends the fibers that are safe, or those that are not, to `to`, which has room for them; n are there already. */
static size_t append_fibers(const struct fiber_set *f, const float *safe, bool wanted, size_t n, struct fiber_set *to)
{
    for (size_t i = 0; i < f->n_fiber; i++) {
        size_t first = f->first_vertex[i], length = f->first_vertex[i + 1] - first;
        if ((safe[i] >= 0.5f) != wanted) continue;
        memcpy(to->position_m + 3 * to->first_vertex[n], f->position_m + 3 * first, 3 * length * sizeof *f->position_m);
        if (f->shape != NULL) memcpy(to->shape + to->first_vertex[n], f->shape + first, length * sizeof *f->shape);
        to->radius_m[n] = f->radius_m[i];
        to->axis_class[n] = f->axis_class[i];
        to->group[n] = f->group[i];
        to->first_vertex[n + 1] = to->first_vertex[n] + length;
        n++;
    }
    return n;
}

status scan_grade_sort(struct fiber_set *f, const float *safe, struct scan_grade *grade, struct error *err)
{
    struct fiber_set sorted;
    fiber_set_init(&sorted);
    status s = fiber_set_reserve(&sorted, f->n_fiber, f->n_vertex, err);
    if (s == STATUS_OK && f->shape != NULL) s = fiber_set_add_shapes(&sorted, err);
    if (s != STATUS_OK) {
        fiber_set_release(&sorted);
        return s;
    }
    memcpy(sorted.tile_size_m, f->tile_size_m, sizeof sorted.tile_size_m);
    size_t n_safe = append_fibers(f, safe, true, 0, &sorted);
    append_fibers(f, safe, false, n_safe, &sorted);
    grade->n_dropped = n_safe > 0 ? f->n_fiber - n_safe : 0;
    fiber_set_release(f);
    *f = sorted;
    return STATUS_OK;
}

void scan_grade_drop(struct fiber_set *f, const struct scan_grade *grade)
{
    if (grade->n_dropped >= f->n_fiber) return;
    f->n_fiber -= grade->n_dropped;
    f->n_vertex = f->first_vertex[f->n_fiber];
}
