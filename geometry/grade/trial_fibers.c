#include "geometry/grade/trial_fibers.h"

#include <math.h>

/* Share of the way from a to b that lies in the box 0 .. size, if a is inside. */
static double way_inside(const double a[3], const double b[3], const double size[3])
{
    double share = 1.0;
    for (int k = 0; k < 3; k++) {
        if (b[k] < 0.0) share = fmin(share, a[k] / (a[k] - b[k]));
        if (b[k] > size[k]) share = fmin(share, (size[k] - a[k]) / (b[k] - a[k]));
    }
    return share;
}

static bool is_inside(const double p[3], const double size[3])
{
    for (int k = 0; k < 3; k++)
        if (!(p[k] >= 0.0 && p[k] <= size[k])) return false;
    return true;
}

struct cutter {
    const struct fiber_set *from;
    double origin_m[3], size_m[3];
    struct fiber_set *to;
};

static void position(const struct cutter *c, size_t i_vertex, double p[3])
{
    for (size_t k = 0; k < 3; k++) p[k] = (double)c->from->position_m[3 * i_vertex + k] - c->origin_m[k];
}

/* Adds a vertex with the section of one of the original fiber. */
static void add_vertex(const struct cutter *c, const double p[3], size_t like)
{
    struct fiber_set *f = c->to;
    for (size_t k = 0; k < 3; k++) f->position_m[3 * f->n_vertex + k] = (float)p[k];
    if (f->shape != NULL && c->from->shape != NULL) f->shape[f->n_vertex] = c->from->shape[like];
    f->n_vertex++;
}

/* Whether the radius of a fiber varies along it. */
static bool radius_varies(const struct fiber_set *f, size_t i)
{
    const size_t first = f->first_vertex[i];
    for (size_t k = first; f->shape != NULL && k < f->first_vertex[i + 1]; k++)
        if (f->shape[k].radius != f->shape[first].radius) return true;
    return false;
}

/* Ends a piece. It is removed again if it has less than two vertices. */
static void end_piece(const struct cutter *c, size_t i_fiber)
{
    struct fiber_set *f = c->to;
    const size_t first = f->first_vertex[f->n_fiber];
    double sum = 0.0;
    if (f->n_vertex < first + 2) {
        f->n_vertex = first;
        return;
    }
    const bool varies = radius_varies(c->from, i_fiber);
    const float radius = c->from->radius_m[i_fiber];
    for (size_t k = first; k < f->n_vertex && f->shape != NULL; k++) {
        if (c->from->shape == NULL) f->shape[k] = fiber_shape_disc(radius);
        if (!varies) f->shape[k].radius = radius;
        sum += (double)f->shape[k].radius;
    }
    f->radius_m[f->n_fiber] = varies ? (float)(sum / (double)(f->n_vertex - first)) : radius;
    f->axis_class[f->n_fiber] = c->from->axis_class[i_fiber];
    f->first_vertex[++f->n_fiber] = f->n_vertex;
}

/* Adds the parts of a fiber that lie in the box, cut at its faces. */
static void cut_fiber(const struct cutter *c, size_t i)
{
    const size_t begin = c->from->first_vertex[i], end = c->from->first_vertex[i + 1];
    for (size_t v = begin; v < end; v++) {
        double p[3], q[3], cut[3];
        position(c, v, p);
        bool here = is_inside(p, c->size_m), before = false;
        if (v > begin) {
            position(c, v - 1, q);
            before = is_inside(q, c->size_m);
        }
        if (v > begin && here != before) {
            double share = here ? way_inside(p, q, c->size_m) : way_inside(q, p, c->size_m);
            const double *a = here ? p : q, *b = here ? q : p;
            for (int k = 0; k < 3; k++) cut[k] = a[k] + share * (b[k] - a[k]);
            if (share > 0.01) add_vertex(c, cut, here ? v : v - 1);
        }
        if (!here && before) end_piece(c, i);
        if (here) add_vertex(c, p, v);
    }
    end_piece(c, i);
}

/* Mean width of the lumens that the scan tells, NaN if it tells none. */
static double told_lumen(const struct fiber_set *f)
{
    double sum = 0.0, n = 0.0;
    for (size_t k = 0; k < f->n_vertex; k++) {
        if (!(f->shape[k].lumen_se > 0.0f)) continue;
        sum += (double)f->shape[k].lumen;
        n += 1.0;
    }
    return n > 0.0 ? sum / n : NAN;
}

/* Removes the parts of the measured sections that `sections` does not keep. */
static void take_sections(struct fiber_set *f, const struct trial_sections *sections)
{
    double other = told_lumen(f);
    if (isnan(other)) other = sections->lumen;
    for (size_t k = 0; k < f->n_vertex; k++) {
        struct fiber_shape *s = &f->shape[k];
        if (!sections->flat || !fiber_shape_has_section(s)) s->ratio = 1.0f;
        const bool told = s->lumen_se > 0.0f;
        s->lumen = !sections->hollow ? 0.0f : told ? s->lumen : (float)other;
    }
}

status trial_fibers_cut(const struct fiber_set *f, const struct trial_box *box, const struct trial_sections *sections,
                        struct fiber_set *out, struct error *err)
{
    struct cutter c = {.from = f, .to = out};
    /* at most every second vertex begins a piece, and a piece has two cut ends */
    status s = fiber_set_reserve(out, f->n_fiber + f->n_vertex / 2, 2 * (f->n_vertex + f->n_fiber), err);
    if (s != STATUS_OK) return s;
    for (int a = 0; a < 3; a++) {
        c.origin_m[a] = (double)box->from[a] * box->voxel_size_m;
        c.size_m[a] = (double)box->n[a] * box->voxel_size_m;
    }
    for (int a = 0; a < 2; a++) out->tile_size_m[a] = c.size_m[a];
    out->n_fiber = 0; /* fiber_set_add_shapes makes room for all vertices, and has no fiber to look at */
    if (f->shape != NULL || sections->hollow) s = fiber_set_add_shapes(out, err);
    if (s != STATUS_OK) return s;
    out->n_vertex = 0;
    for (size_t i = 0; i < f->n_fiber; i++) cut_fiber(&c, i);
    if (out->shape != NULL) take_sections(out, sections);
    return STATUS_OK;
}

/* Sums of a number over the length. */
struct sums {
    double n, x, xx;
};

static void add(struct sums *s, double x, double length)
{
    s->n += length;
    s->x += length * x;
    s->xx += length * x * x;
}

static double mean_of(const struct sums *s) { return s->n > 0.0 ? s->x / s->n : NAN; }

static double sd_of(const struct sums *s)
{
    return s->n > 0.0 ? sqrt(fmax(0.0, s->xx / s->n - mean_of(s) * mean_of(s))) : NAN;
}

void trial_fibers_describe(const struct fiber_set *f, struct scan_trial *t)
{
    struct sums radius = {0}, ratio = {0}, lumen = {0};
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const float *p = f->position_m + 3 * k;
            const double length =
                hypot(hypot((double)p[3] - (double)p[0], (double)p[4] - (double)p[1]), (double)p[5] - (double)p[2]);
            add(&radius, (double)fiber_radius_m(f, i, k), length);
            add(&ratio, f->shape != NULL ? (double)f->shape[k].ratio : 1.0, length);
            add(&lumen, f->shape != NULL ? (double)f->shape[k].lumen : 0.0, length);
        }
    t->radius_spread = sd_of(&radius) / mean_of(&radius);
    t->axis_ratio = mean_of(&ratio);
    t->axis_ratio_spread = sd_of(&ratio);
    t->lumen = mean_of(&lumen);
    t->lumen_spread = sd_of(&lumen);
}
