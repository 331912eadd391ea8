#include "geometry/fibers/seam/fiber_seam.h"

#include "geometry/fibers/seam/seam_step.h"
#include "geometry/fibers/seam/seam_warp.h"

#include <math.h>
#include <string.h>

static const double CONTINUED_RADII = 1.0, JOIN_RADII = 6.0;
/* Length over which a move fades out, in radii and in lengths of the move, and over the length of the fiber. */
static const double FADE_RADII = 8.0, FADE_MOVES = 8.0, FADE_LENGTHS = 0.5;

static status measure_axis(const struct fiber_set *f, int axis, struct fiber_seam *seam, struct error *err)
{
    struct seam_ends s;
    double offset_m = 0.0, angle_rad = 0.0, d[2];
    status st = seam_ends_collect(&s, f, axis, err);
    if (st == STATUS_OK) st = seam_ends_match(&s, SEAM_BY_DISTANCE, CONTINUED_RADII, NULL, err);
    for (size_t i = 0; i < s.n[0] && st == STATUS_OK; i++) {
        if (s.partner[i] == SIZE_MAX) continue;
        seam_ends_offset(&s, i, d);
        offset_m += hypot(d[0], d[1]);
        angle_rad += seam_ends_angle_rad(&s, i);
    }
    seam->n_end[axis] = seam_ends_count(&s);
    seam->n_continued[axis] = 2 * s.n_pair;
    seam->share[axis] = seam->n_end[axis] > 0 ? (double)seam->n_continued[axis] / (double)seam->n_end[axis] : NAN;
    seam->offset_m[axis] = s.n_pair > 0 ? offset_m / (double)s.n_pair : NAN;
    seam->angle_rad[axis] = s.n_pair > 0 ? angle_rad / (double)s.n_pair : NAN;
    seam_ends_release(&s);
    return st == STATUS_OK ? seam_step_measure(f, axis, &seam->step[axis], &seam->step_inside[axis], err) : st;
}

status fiber_seam_measure(const struct fiber_set *f, struct fiber_seam *seam, struct error *err)
{
    status st = measure_axis(f, 0, seam, err);
    return st == STATUS_OK ? measure_axis(f, 1, seam, err) : st;
}

static void warp_fibers(struct fiber_set *f, const struct seam_warp *w)
{
    for (size_t i = 0; i < f->n_vertex; i++) {
        double p[3];
        for (size_t a = 0; a < 3; a++) p[a] = (double)f->position_m[3 * i + a];
        seam_warp_move(w, p);
        for (size_t a = 0; a < 3; a++) f->position_m[3 * i + a] = (float)p[a];
    }
}

/* How an end moves: its shift, and how the shift changes by the arc length from the end inwards. */
struct move {
    double shift_m[3], slope[3];
};

static double distance_between(const float a[3], const float b[3])
{
    double sum = 0.0;
    for (int k = 0; k < 3; k++) sum += ((double)a[k] - (double)b[k]) * ((double)a[k] - (double)b[k]);
    return sqrt(sum);
}

static double fiber_length(const struct fiber_set *f, size_t i)
{
    double length = 0.0;
    for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++)
        length += distance_between(f->position_m + 3 * k, f->position_m + 3 * k + 3);
    return length;
}

/* Moves an end and the vertices next to it. The move fades out as a cubic with this shift and slope at the end and none
 * at the other end of the fade. */
static void move_end(struct fiber_set *f, const struct seam_end *e, const struct move *m)
{
    const size_t first = f->first_vertex[e->i_fiber], n = f->first_vertex[e->i_fiber + 1] - first;
    const double shift = hypot(hypot(m->shift_m[0], m->shift_m[1]), m->shift_m[2]);
    const double fade =
        fmin(fmax(FADE_RADII * e->radius, FADE_MOVES * shift), FADE_LENGTHS * fiber_length(f, e->i_fiber));
    double along = 0.0;
    float before[3];
    for (size_t k = 0; k < n; k++) {
        float *p = f->position_m + 3 * (e->last ? first + n - 1 - k : first + k);
        if (k > 0) along += distance_between(p, before);
        if (along >= fade) return;
        memcpy(before, p, sizeof before);
        const double u = along / fade, of_shift = 1.0 - u * u * (3.0 - 2.0 * u),
                     of_slope = along * (1.0 - u) * (1.0 - u);
        for (int a = 0; a < 3; a++) p[a] = (float)((double)p[a] + of_shift * m->shift_m[a] + of_slope * m->slope[a]);
    }
}

/* The move of one end of a pair: onto the face, to the midpoint of both, and to their mean direction. half: from
 * the end to the midpoint in the plane of the face, along the other axis and z. */
static struct move move_of(const struct seam_ends *s, const struct seam_end *e, const struct seam_end *partner,
                           const double half_m[2])
{
    const int axis = s->axis, plane[2] = {1 - axis, 2};
    struct move m = {{0.0}, {0.0}};
    m.shift_m[axis] = (e->t[axis] < 0.0 ? 0.0 : s->f->tile_size_m[axis]) - e->p[axis];
    for (int k = 0; k < 2; k++) {
        const int a = plane[k];
        m.shift_m[a] = e->at[k] - e->p[a] + half_m[k];
        const double own = e->t[a] / e->t[axis], other = partner->t[a] / partner->t[axis];
        /* the slope along the axis becomes the mean of both; inwards the axis runs against the tangent */
        m.slope[a] = -0.5 * (other - own) * e->t[axis];
    }
    return m;
}

static void join_pair(struct fiber_set *f, const struct seam_ends *s, size_t i, double *shift_m)
{
    const struct seam_end *low = &s->end[0][i], *high = &s->end[1][s->partner[i]];
    double offset[2];
    seam_ends_offset(s, i, offset);
    const double up[2] = {0.5 * offset[0], 0.5 * offset[1]}, down[2] = {-0.5 * offset[0], -0.5 * offset[1]};
    const struct move of_low = move_of(s, low, high, up), of_high = move_of(s, high, low, down);
    move_end(f, low, &of_low);
    move_end(f, high, &of_high);
    *shift_m += hypot(up[0], up[1]);
}

static status join_axis(struct fiber_set *f, int axis, struct seam_join *join, struct error *err)
{
    struct seam_ends s;
    struct seam_warp w = {{{0}}};
    double shift_m = 0.0;
    status st = seam_ends_collect(&s, f, axis, err);
    if (st == STATUS_OK) st = seam_warp_find(&s, &w, err);
    seam_ends_release(&s);
    if (st == STATUS_OK) warp_fibers(f, &w);
    join->warp_m[axis] = seam_warp_rms(&w);
    seam_warp_release(&w);
    if (st == STATUS_OK) st = seam_ends_collect(&s, f, axis, err);
    if (st == STATUS_OK) st = seam_ends_match(&s, SEAM_BY_SHAPE, JOIN_RADII, NULL, err);
    for (size_t i = 0; i < s.n[0] && st == STATUS_OK; i++)
        if (s.partner[i] != SIZE_MAX) join_pair(f, &s, i, &shift_m);
    join->shift_m[axis] = s.n_pair > 0 ? shift_m / (double)s.n_pair : NAN;
    join->n_joined += s.n_pair;
    seam_ends_release(&s);
    return st;
}

status fiber_seam_join(struct fiber_set *f, struct seam_join *join, struct error *err)
{
    *join = (struct seam_join){.shift_m = {NAN, NAN}};
    status st = join_axis(f, 0, join, err);
    return st == STATUS_OK ? join_axis(f, 1, join, err) : st;
}
