#include "geometry/grade/section_misfit.h"

#include "geometry/grade/grade_points.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* N_AROUND: places around an axis. N_POINT: points of a window, a quarter of a diameter apart. N_PRODUCT: products of
 * two sections each in a window inside of a fiber; MOST_APART: largest distance of the two, in points. LEAST_WINDOWS:
 * of a line that is judged by itself. */
enum { N_AROUND = 12, N_POINT = 8, N_PRODUCT = 4, MOST_APART = 4, LEAST_WINDOWS = 4 };
/* Least distance of two sections that are multiplied, in voxels: scanners' noise is correlated over less. It is not
 * larger, because fibers turn around each other in a yarn. */
static const double LEAST_APART_VOXEL = 3.2;
/* Distance from the axis of places just within the surface, in radii. */
static const double RING = 0.95;
/* Depth below the surface, in blurs, at which single fibers are solid whatever is beside them, and the least distance
 * from the axis of places there, in radii; LEAST_BLUR in voxels. */
static const double DEPTH_BLURS = 2.0, LEAST_BLUR = 0.5, LEAST_RING = 0.35;
/* Deviations on the ellipse of the section count so much more than those on a circle: an ellipse fits a yarn, too, but
 * not as well as a flat fiber. */
static const double OF_ELLIPSE = 1.4;
/* Deviation inside of a line, over its density, above which the line holds several fibers, and the standard errors by
 * which it is above that. Single fibers have up to 0.04, yarns 0.06 to 0.4 (geometry/NOTES.md). */
static const double MOST_INSIDE = 0.055, SURE = 2.0;

/* Sums over the windows of a fiber; deviations on circles and on the ellipses of the sections. */
struct deviation_sum {
    double product[2], square[2], level;
    size_t n;
};

struct misfit_sum {
    struct deviation_sum surface, inside;
    double length; /* voxels */
};

struct misfit_job {
    const struct volume *v;
    const struct fiber_set *f;
    struct grade_points points;
    double depth; /* of the places inside of fibers, voxels */
    struct misfit_sum *of_fiber;
};

/* Turns e along with the fiber, whose direction is t, and sets o at a right angle to both. */
static void turn_frame(const float t[3], double e[3], double o[3])
{
    double along = 0.0, norm = 0.0;
    int least = 0;
    for (int a = 0; a < 3; a++) along += (double)t[a] * e[a];
    for (int a = 0; a < 3; a++) e[a] -= along * (double)t[a];
    for (int a = 0; a < 3; a++) norm += e[a] * e[a];
    for (int a = 1; a < 3; a++)
        if (fabsf(t[a]) < fabsf(t[least])) least = a;
    if (norm < 1e-6) {
        for (int a = 0; a < 3; a++) e[a] = (a == least ? 1.0 : 0.0) - (double)t[least] * (double)t[a];
        norm = 1.0 - (double)t[least] * (double)t[least];
    }
    for (int a = 0; a < 3; a++) e[a] /= sqrt(norm);
    for (int a = 0; a < 3; a++)
        o[a] = (double)t[(a + 1) % 3] * e[(a + 2) % 3] - (double)t[(a + 2) % 3] * e[(a + 1) % 3];
}

/* The vertex of fiber i that is nearest to point p; `from` is one before it. */
static size_t nearest_vertex(const struct misfit_job *j, size_t i, const struct grade_point *p, size_t from)
{
    double least = INFINITY;
    for (size_t k = from; k < j->f->first_vertex[i + 1]; k++) {
        double d2 = 0.0;
        for (size_t a = 0; a < 3; a++) {
            const double d = (double)j->f->position_m[3 * k + a] / j->v->voxel_size_m[0] - (double)p->p[a];
            d2 += d * d;
        }
        if (d2 > least) break;
        least = d2;
        from = k;
    }
    return from;
}

/* Distance of the surface in the direction of the unit vector d, which lies across the fiber. */
static double surface_at(const struct fiber_shape *shape, double radius, const double d[3])
{
    double along = 0.0;
    if (shape == NULL || !fiber_shape_has_section(shape)) return radius;
    for (int a = 0; a < 3; a++) along += d[a] * (double)shape->long_axis[a];
    const double c2 = fmin(1.0, along * along), ratio = (double)shape->ratio;
    return radius / sqrt(c2 / ratio + (1.0 - c2) * ratio);
}

/* A section: the point, two unit vectors across the fiber there, its radius, and its shape or NULL. */
struct section {
    const struct grade_point *at;
    double e[3], o[3], radius;
    const struct fiber_shape *shape;
};

/* Adds the densities on a ring around the axis: of the shape, or a circle. depth: below the surface; 0: RING. */
static void add_ring(const struct volume *v, const struct section *s, bool of_shape, double depth, double sum[N_AROUND])
{
    for (int k = 0; k < N_AROUND; k++) {
        const double angle = 2.0 * M_PI * k / N_AROUND;
        double d[3], x[3];
        for (int a = 0; a < 3; a++) d[a] = cos(angle) * s->e[a] + sin(angle) * s->o[a];
        const double surface = of_shape ? surface_at(s->shape, s->radius, d) : s->radius;
        const double away = depth > 0.0 ? fmax(surface - depth, LEAST_RING * surface) : RING * surface;
        for (int a = 0; a < 3; a++) x[a] = (double)s->at->p[a] + away * d[a];
        sum[k] += grade_density_at(v, x);
    }
}

/* Takes the mean and the first harmonic out. */
static void leave_deviation(double x[N_AROUND])
{
    double mean = 0.0, c = 0.0, s = 0.0;
    for (int k = 0; k < N_AROUND; k++) {
        mean += x[k] / N_AROUND;
        c += 2.0 * x[k] * cos(2.0 * M_PI * k / N_AROUND) / N_AROUND;
        s += 2.0 * x[k] * sin(2.0 * M_PI * k / N_AROUND) / N_AROUND;
    }
    for (int k = 0; k < N_AROUND; k++)
        x[k] -= mean + c * cos(2.0 * M_PI * k / N_AROUND) + s * sin(2.0 * M_PI * k / N_AROUND);
}

/* Moves to a point of the same fiber. vertex: the one nearest to the last point so far. Returns the density there. */
static double move_to(const struct misfit_job *j, size_t point, struct section *s, size_t *vertex)
{
    double x[3];
    s->at = &j->points.point[point];
    turn_frame(s->at->t, s->e, s->o);
    if (j->f->shape != NULL) s->shape = &j->f->shape[ *vertex = nearest_vertex(j, s->at->fiber, s->at, *vertex)];
    for (int a = 0; a < 3; a++) x[a] = (double)s->at->p[a];
    return grade_density_at(j->v, x);
}

/* Adds a window within the surface, the first point of which is `first`: every second section times those between. */
static void add_window(const struct misfit_job *j, size_t first, struct section *s, size_t *vertex,
                       struct deviation_sum *sum)
{
    double ring[2][2][N_AROUND] = {{{0.0}}}, level = 0.0;
    const double n = N_POINT;
    for (size_t k = 0; k < N_POINT; k++) {
        level += move_to(j, first + k, s, vertex) / n;
        for (int of_shape = 0; of_shape < 2; of_shape++) add_ring(j->v, s, of_shape != 0, 0.0, ring[of_shape][k & 1]);
    }
    for (int of_shape = 0; of_shape < 2; of_shape++) {
        double(*half)[N_AROUND] = ring[of_shape], product = 0.0;
        leave_deviation(half[0]);
        leave_deviation(half[1]);
        for (int k = 0; k < N_AROUND; k++) product += half[0][k] * half[1][k] / (0.25 * n * n * N_AROUND);
        sum->product[of_shape] += product;
        sum->square[of_shape] += product * product;
    }
    sum->level += level * level;
    sum->n++;
}

/* Adds the windows of a fiber. */
static void add_surface(const struct misfit_job *j, size_t i_fiber, struct deviation_sum *sum)
{
    struct section s = {.radius = j->points.radius[i_fiber]};
    const size_t end = j->points.first[i_fiber + 1];
    size_t vertex = j->f->first_vertex[i_fiber];
    for (size_t first = j->points.first[i_fiber]; first + N_POINT <= end; first += N_POINT)
        add_window(j, first, &s, &vertex, sum);
}

/* The same inside of the fiber: each section times one that is some points before it. */
static void add_inside(const struct misfit_job *j, size_t i_fiber, struct deviation_sum *sum)
{
    struct section s = {.radius = j->points.radius[i_fiber]};
    const size_t first = j->points.first[i_fiber], end = j->points.first[i_fiber + 1],
                 apart = (size_t)fmin(MOST_APART, ceil(LEAST_APART_VOXEL / (0.5 * s.radius)));
    double ring[MOST_APART + 1][2][N_AROUND], product[2] = {0.0}, level = 0.0;
    size_t vertex = j->f->first_vertex[i_fiber], n = 0;
    for (size_t i = first; i < end; i++) {
        double(*now)[N_AROUND] = ring[(i - first) % (apart + 1)];
        memset(now, 0, sizeof ring[0]);
        const double density = move_to(j, i, &s, &vertex);
        for (int of_shape = 0; of_shape < 2; of_shape++) {
            add_ring(j->v, &s, of_shape != 0, j->depth, now[of_shape]);
            leave_deviation(now[of_shape]);
        }
        if (i - first < apart) continue;
        double(*before)[N_AROUND] = ring[(i - first - apart) % (apart + 1)];
        for (int k = 0; k < 2 * N_AROUND; k++)
            product[k / N_AROUND] += now[k / N_AROUND][k % N_AROUND] * before[k / N_AROUND][k % N_AROUND] / N_AROUND;
        level += density;
        if (++n < N_PRODUCT) continue;
        for (int k = 0; k < 2; k++) {
            sum->product[k] += product[k] / N_PRODUCT;
            sum->square[k] += product[k] * product[k] / (N_PRODUCT * N_PRODUCT);
        }
        sum->level += level * level / (N_PRODUCT * N_PRODUCT);
        sum->n++;
        product[0] = product[1] = level = 0.0;
        n = 0;
    }
}

static void misfit_of_fiber(void *context, size_t i_fiber, size_t i_thread)
{
    struct misfit_job *j = context;
    struct misfit_sum *sum = &j->of_fiber[i_fiber];
    (void)i_thread;
    scratch_keep_within(j->v->space);
    add_surface(j, i_fiber, &sum->surface);
    add_inside(j, i_fiber, &sum->inside);
    sum->length = 0.5 * j->points.radius[i_fiber] * (double)(j->points.first[i_fiber + 1] - j->points.first[i_fiber]);
}

/* Variance of the windows of a line about their mean. */
static double variance_of(const struct deviation_sum *sum, int k)
{
    const double n = (double)sum->n, mean = sum->product[k] / n;
    return fmax(0.0, sum->square[k] / n - mean * mean);
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Median over the lines of the variance of their windows, by noise alone if most lines are single fibers. work:
 * room for n_fiber numbers. */
static double usual_variance(const struct misfit_job *j, int k, double *work)
{
    size_t n = 0;
    for (size_t i = 0; i < j->f->n_fiber; i++)
        if (j->of_fiber[i].inside.n >= LEAST_WINDOWS) work[n++] = variance_of(&j->of_fiber[i].inside, k);
    qsort(work, n, sizeof *work, ascending);
    return n > 0 ? work[n / 2] : 0.0;
}

/* Whether a line holds several fibers: its inside varies on circles and on ellipses. The windows of yarns vary by their
 * fibers, too, so the usual variance counts if it is smaller. */
static bool holds_several(const struct deviation_sum *sum, const double usual[2])
{
    bool several = sum->n >= LEAST_WINDOWS;
    for (int k = 0; k < 2 && several; k++) {
        const double n = (double)sum->n, se = sqrt(fmin(usual[k], variance_of(sum, k)) / (n - 1.0));
        const double scale = k == 0 ? 1.0 : OF_ELLIPSE * OF_ELLIPSE;
        several = scale * (sum->product[k] / n - SURE * se) > MOST_INSIDE * MOST_INSIDE * sum->level / n;
    }
    return several;
}

static void sum_fibers(const struct misfit_job *j, double *work, struct section_misfit *misfit)
{
    const double usual[2] = {usual_variance(j, 0, work), usual_variance(j, 1, work)};
    double product[2] = {0.0}, level = 0.0, length = 0.0, several = 0.0;
    for (size_t i = 0; i < j->f->n_fiber; i++) {
        const struct misfit_sum *sum = &j->of_fiber[i];
        for (int k = 0; k < 2; k++) product[k] += sum->surface.product[k];
        level += sum->surface.level;
        length += sum->length;
        several += holds_several(&sum->inside, usual) ? sum->length : 0.0;
    }
    for (int k = 0; k < 2; k++) product[k] = sqrt(fmax(0.0, product[k] / level));
    if (level > 0.0) misfit->surface = fmin(product[0], OF_ELLIPSE * product[1]);
    if (length > 0.0) misfit->several_share = several / length;
}

status section_misfit_measure(const struct volume *v, const struct fiber_set *f, double blur_voxel,
                              struct thread_pool *pool, struct section_misfit *misfit, struct error *err)
{
    struct misfit_job j = {.v = v, .f = f, .depth = DEPTH_BLURS * fmax(LEAST_BLUR, blur_voxel)};
    *misfit = (struct section_misfit){NAN, NAN};
    if (f->n_fiber == 0) return STATUS_OK;
    status s = grade_points_make(&j.points, f, v->voxel_size_m[0], 1.0, err);
    double *work = malloc(f->n_fiber * sizeof *work);
    j.of_fiber = calloc(f->n_fiber, sizeof *j.of_fiber);
    if (s == STATUS_OK && (j.of_fiber == NULL || work == NULL))
        s = error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    if (s == STATUS_OK) s = thread_pool_run(pool, f->n_fiber, misfit_of_fiber, &j, NULL);
    if (s == STATUS_OK) sum_fibers(&j, work, misfit);
    free(work);
    free(j.of_fiber);
    grade_points_release(&j.points);
    return s;
}
