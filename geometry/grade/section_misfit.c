#include "geometry/grade/section_misfit.h"

#include "geometry/grade/grade_points.h"

#include <math.h>
#include <stdlib.h>

/* N_AROUND: places around an axis; N_POINT: points of a window, a quarter of a diameter apart. */
enum { N_AROUND = 12, N_POINT = 8 };
/* Distance of these places from the axis, in radii. */
static const double RING = 0.95;
/* Deviations on the ellipse of the section count so much more than those on a circle: an ellipse fits a yarn, too, but
 * not as well as a flat fiber. */
static const double OF_ELLIPSE = 1.4;

/* Sums over the windows of a fiber; deviations on circles and on the ellipses of the sections. */
struct misfit_sum {
    double deviation[2], level;
};

struct misfit_job {
    const struct volume *v;
    const struct fiber_set *f;
    struct grade_points points;
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

/* Adds the densities on a ring around the axis: of the shape, or a circle. */
static void add_ring(const struct volume *v, const struct section *s, bool of_shape, double sum[N_AROUND])
{
    for (int k = 0; k < N_AROUND; k++) {
        const double angle = 2.0 * M_PI * k / N_AROUND;
        double d[3], x[3];
        for (int a = 0; a < 3; a++) d[a] = cos(angle) * s->e[a] + sin(angle) * s->o[a];
        const double away = RING * (of_shape ? surface_at(s->shape, s->radius, d) : s->radius);
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

/* Adds a window, whose first point is `first`. vertex: the one nearest to the last point so far. */
static void add_window(const struct misfit_job *j, size_t i_fiber, size_t first, struct section *s, size_t *vertex)
{
    struct misfit_sum *sum = &j->of_fiber[i_fiber];
    double ring[2][2][N_AROUND] = {{{0.0}}}, level = 0.0;
    for (size_t k = 0; k < N_POINT; k++) {
        double x[3];
        s->at = &j->points.point[first + k];
        turn_frame(s->at->t, s->e, s->o);
        if (j->f->shape != NULL) s->shape = &j->f->shape[ *vertex = nearest_vertex(j, i_fiber, s->at, *vertex)];
        for (int of_shape = 0; of_shape < 2; of_shape++) add_ring(j->v, s, of_shape != 0, ring[of_shape][k & 1]);
        for (int a = 0; a < 3; a++) x[a] = (double)s->at->p[a];
        level += grade_density_at(j->v, x) / N_POINT;
    }
    for (int of_shape = 0; of_shape < 2; of_shape++) {
        double(*half)[N_AROUND] = ring[of_shape];
        leave_deviation(half[0]);
        leave_deviation(half[1]);
        for (int k = 0; k < N_AROUND; k++)
            sum->deviation[of_shape] += half[0][k] * half[1][k] / (0.25 * N_POINT * N_POINT * N_AROUND);
    }
    sum->level += level * level;
}

static void misfit_of_fiber(void *context, size_t i_fiber, size_t i_thread)
{
    struct misfit_job *j = context;
    struct section s = {.radius = j->points.radius[i_fiber]};
    size_t vertex = j->f->first_vertex[i_fiber];
    (void)i_thread;
    scratch_keep_within(j->v->space);
    for (size_t first = j->points.first[i_fiber]; first + N_POINT <= j->points.first[i_fiber + 1]; first += N_POINT)
        add_window(j, i_fiber, first, &s, &vertex);
}

status section_misfit_measure(const struct volume *v, const struct fiber_set *f, struct thread_pool *pool,
                              double *misfit, struct error *err)
{
    struct misfit_job j = {.v = v, .f = f};
    double deviation[2] = {0.0}, level = 0.0;
    *misfit = NAN;
    if (f->n_fiber == 0) return STATUS_OK;
    status s = grade_points_make(&j.points, f, v->voxel_size_m[0], 1.0, err);
    j.of_fiber = calloc(f->n_fiber, sizeof *j.of_fiber);
    if (s == STATUS_OK && j.of_fiber == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    if (s == STATUS_OK) s = thread_pool_run(pool, f->n_fiber, misfit_of_fiber, &j, NULL);
    for (size_t i = 0; s == STATUS_OK && i < f->n_fiber; i++) {
        for (int k = 0; k < 2; k++) deviation[k] += j.of_fiber[i].deviation[k];
        level += j.of_fiber[i].level;
    }
    for (int k = 0; k < 2; k++) deviation[k] = sqrt(fmax(0.0, deviation[k] / level));
    if (level > 0.0) *misfit = fmin(deviation[0], OF_ELLIPSE * deviation[1]);
    free(j.of_fiber);
    grade_points_release(&j.points);
    return s;
}
