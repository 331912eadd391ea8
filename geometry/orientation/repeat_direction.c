#include "geometry/orientation/repeat_direction.h"
#include "base/angle.h"

#include <math.h>
#include <stdlib.h>

enum { N_CELL = 128, N_HEIGHT = 8, N_FINE_HEIGHT = 128 };

static const double CONE_RAD = 0.1047;               /* 6 degrees */
static const double SHORTEST = 0.25, LONGEST = 0.75; /* of the extent of the volume along the direction */
static const double LEAST_CORRELATION = 0.4;
static const double MOST_RISE = 0.2; /* 11 degrees out of the plane */
static const double SYSTEMATIC_DEG = 1.0;

struct cells {
    const struct volume *v;
    size_t n[2], block[3], n_z;
    double size_m[3];
    float void_value; /* value of cells outside of the scan */
    float *value;     /* [(z * n[1] + y) * n[0] + x] */
};

static void fill_height(void *context, size_t z, size_t i_thread)
{
    (void)i_thread;
    struct cells *c = context;
    const size_t *n = c->v->n;
    float *out = c->value + z * c->n[0] * c->n[1];
    size_t to = (z + 1) * c->block[2] < n[2] ? (z + 1) * c->block[2] : n[2], count = 0;
    for (size_t i = 0; i < c->n[0] * c->n[1]; i++) out[i] = 0.0f;
    for (size_t k = z * c->block[2]; k < to; k++, count++) {
        scratch_keep_within(c->v->space);
        for (size_t j = 0; j < c->n[1] * c->block[1]; j++) {
            const float *row = c->v->density + volume_index(n, 0, j, k);
            float *to_row = out + j / c->block[1] * c->n[0];
            for (size_t i = 0; i < c->n[0] * c->block[0]; i++)
                to_row[i / c->block[0]] += isfinite(row[i]) ? row[i] : c->void_value;
        }
    }
    float scale = 1.0f / (float)(count * c->block[0] * c->block[1]);
    for (size_t i = 0; i < c->n[0] * c->n[1]; i++) out[i] *= scale;
}

/* Normalised correlation of the cells with themselves shifted by (dx, dy, dz), over the overlap. */
static double correlation(const struct cells *c, long dx, long dy, long dz)
{
    size_t width = c->n[0] - (size_t)labs(dx), count = 0;
    double sa = 0.0, sb = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
    for (long z = dz < 0 ? -dz : 0; z < (long)c->n_z - (dz > 0 ? dz : 0); z++)
        for (long y = dy < 0 ? -dy : 0; y < (long)c->n[1] - (dy > 0 ? dy : 0); y++) {
            const float *a = c->value + ((size_t)z * c->n[1] + (size_t)y) * c->n[0] + (dx < 0 ? -dx : 0);
            const float *b = c->value + ((size_t)(z + dz) * c->n[1] + (size_t)(y + dy)) * c->n[0] + (dx > 0 ? dx : 0);
            float ra = 0.0f, rb = 0.0f, raa = 0.0f, rbb = 0.0f, rab = 0.0f;
            for (size_t x = 0; x < width; x++) {
                ra += a[x], rb += b[x];
                raa += a[x] * a[x], rbb += b[x] * b[x], rab += a[x] * b[x];
            }
            sa += (double)ra, sb += (double)rb, aa += (double)raa, bb += (double)rbb, ab += (double)rab;
            count += width;
        }
    double n = (double)count, va = aa - sa * sa / n, vb = bb - sb * sb / n;
    return va > 0.0 && vb > 0.0 ? (ab - sa * sb / n) / sqrt(va * vb) : 0.0;
}

struct search {
    const struct cells *c;
    int axis; /* axis of the shift's larger component */
    double angle;
    long from;
    struct shift {
        double correlation;
        long d[2];
    } * best; /* one per length */
};

static double angle_between(double a, double b)
{
    double d = a - b;
    return fabs(d - M_PI * round(d / M_PI));
}

static double shift_angle(const struct cells *c, double dx, double dy)
{
    return atan2(dy * c->size_m[1], dx * c->size_m[0]);
}

/* Tries all shifts of one length along the main axis that lie within the cone. */
static void try_length(void *context, size_t i, size_t i_thread)
{
    (void)i_thread;
    struct search *s = context;
    const struct cells *c = s->c;
    long along = s->from + (long)i, most = (long)c->n[1 - s->axis] - (long)c->n[1 - s->axis] / 4;
    s->best[i] = (struct shift){.correlation = -1.0};
    for (long across = -most; across <= most; across++) {
        struct shift t = {.d = {s->axis == 0 ? along : across, s->axis == 0 ? across : along}};
        if (angle_between(shift_angle(c, (double)t.d[0], (double)t.d[1]), s->angle) > CONE_RAD) continue;
        t.correlation = correlation(c, t.d[0], t.d[1], 0);
        if (t.correlation > s->best[i].correlation) s->best[i] = t;
    }
}

/* Position of the peak of the parabola through three values, relative to the middle one; 0 if there is no peak. */
static double peak_offset(double before, double at, double after)
{
    double bend = before - 2.0 * at + after;
    return bend < 0.0 ? fmax(-0.5, fmin(0.5, 0.5 * (before - after) / bend)) : 0.0;
}

static status best_shift(struct search *s, struct thread_pool *pool, struct shift *best, struct error *err)
{
    long longest = (long)(LONGEST * (double)s->c->n[s->axis]), n;
    s->from = (long)ceil(SHORTEST * (double)s->c->n[s->axis]);
    n = longest - s->from + 1;
    *best = (struct shift){.correlation = -1.0};
    if (n < 3 || s->from < 4) return STATUS_OK;
    s->best = malloc((size_t)n * sizeof *s->best);
    if (s->best == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot find the repeat: out of memory");
    status st = thread_pool_run(pool, (size_t)n, try_length, s, NULL);
    for (long i = 0; i < n && st == STATUS_OK; i++)
        if (s->best[i].correlation > best->correlation) *best = s->best[i];
    free(s->best);
    return st == STATUS_OK ? st : error_set(err, st, "finding the repeat was cancelled");
}

/* Rise of the cloth over one repeat in metres: the height of the best correlation. NAN if that is the first or last
 * height tried. */
static double rise_m(const struct cells *fine, const long d[2], double length_m)
{
    long most = (long)fmin(MOST_RISE * length_m / fine->size_m[2], 0.5 * (double)fine->n_z), best = 0;
    double highest = -1.0;
    for (long dz = -most; dz <= most; dz++) {
        double x = correlation(fine, d[0], d[1], dz);
        if (x <= highest) continue;
        highest = x;
        best = dz;
    }
    if (labs(best) >= most) return NAN;
    double off = peak_offset(correlation(fine, d[0], d[1], best - 1), highest, correlation(fine, d[0], d[1], best + 1));
    return ((double)best + off) * fine->size_m[2];
}

static status refine(const struct cells *c, const struct cells *fine, struct thread_pool *pool, size_t p,
                     struct main_directions *m, struct error *err)
{
    double *u = m->direction[p];
    struct search s = {.c = c, .axis = fabs(u[0]) >= fabs(u[1]) ? 0 : 1, .angle = atan2(u[1], u[0])};
    struct shift best;
    m->correlation[p] = m->repeat_m[p] = 0.0;
    status st = best_shift(&s, pool, &best, err);
    if (st != STATUS_OK) return st;
    m->correlation[p] = fmax(0.0, best.correlation);
    if (best.correlation < LEAST_CORRELATION) return STATUS_OK;
    long across[2] = {s.axis == 1, s.axis == 0};
    double before = correlation(c, best.d[0] - across[0], best.d[1] - across[1], 0),
           after = correlation(c, best.d[0] + across[0], best.d[1] + across[1], 0);
    /* the best shift lies at the edge of the cone, so it is not a peak */
    if (before >= best.correlation || after >= best.correlation) return STATUS_OK;
    double off = peak_offset(before, best.correlation, after);
    double d[3] = {((double)best.d[0] + off * (double)across[0]) * c->size_m[0],
                   ((double)best.d[1] + off * (double)across[1]) * c->size_m[1]};
    double length = hypot(d[0], d[1]), sign = d[0] * u[0] + d[1] * u[1] < 0.0 ? -1.0 : 1.0;
    m->repeat_m[p] = length;
    m->se_deg[p] = angle_to_deg(0.5 * c->size_m[1 - s.axis] / length);
    d[2] = rise_m(fine, best.d, length);
    if (isnan(d[2]))
        d[2] = sign * length * u[2] / hypot(u[0], u[1]);
    else
        m->tilt_se_deg[p] = angle_to_deg(0.5 * fine->size_m[2] / length);
    for (int a = 0; a < 3; a++) u[a] = sign * d[a] / hypot(length, d[2]);
    return STATUS_OK;
}

static status make_cells(const struct volume *v, double void_value, size_t n_height, struct thread_pool *pool,
                         struct cells *c, struct error *err)
{
    *c = (struct cells){.v = v, .void_value = (float)void_value};
    for (int a = 0; a < 3; a++) {
        size_t n = a < 2 ? N_CELL : n_height;
        c->block[a] = (v->n[a] + n - 1) / n;
        c->size_m[a] = (double)c->block[a] * v->voxel_size_m[a];
    }
    for (int a = 0; a < 2; a++) c->n[a] = v->n[a] / c->block[a];
    c->n_z = (v->n[2] + c->block[2] - 1) / c->block[2];
    c->value = malloc(c->n[0] * c->n[1] * c->n_z * sizeof *c->value);
    if (c->value == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot find the repeat: out of memory");
    status s = thread_pool_run(pool, c->n_z, fill_height, c, NULL);
    return s == STATUS_OK ? s : error_set(err, s, "finding the repeat was cancelled");
}

status repeat_directions_refine(const struct volume *v, double void_value, struct thread_pool *pool,
                                struct main_directions *m, struct error *err)
{
    struct cells coarse, fine = {.value = NULL};
    status s = make_cells(v, void_value, N_HEIGHT, pool, &coarse, err);
    if (s == STATUS_OK) s = make_cells(v, void_value, N_FINE_HEIGHT, pool, &fine, err);
    for (size_t p = 0; p < 2 && s == STATUS_OK; p++) {
        if (hypot(m->direction[p][0], m->direction[p][1]) < 0.1) continue;
        s = refine(&coarse, &fine, pool, p, m, err);
        if (s == STATUS_OK && m->repeat_m[p] == 0.0) m->se_deg[p] = hypot(m->se_deg[p], SYSTEMATIC_DEG);
    }
    free(coarse.value);
    free(fine.value);
    return s;
}
