/* Converts strands to fibers: a smooth curve through the nodes, cut where it leaves the tile, and moved to its
 * height. */
#include "geometry/cloth/strand.h"

#include <math.h>
#include <stdlib.h>

/* Collects fibers in two passes over the same code; the first, with f == NULL, only counts. */
struct emitter {
    double tile_m[2];
    double z_shift_m;
    const struct strand *strand;
    uint8_t group;                        /* of the present piece */
    struct fiber_set *f;                  /* NULL: count */
    struct strand_section here, *section; /* at the present place; of each vertex, NULL where all are round */
    size_t n_fiber, n_vertex;
    size_t n_here; /* vertices of the present piece */
    long cell[2];  /* tile of the present piece */
};

static void put_vertex(struct emitter *e, const double p[3])
{
    if (e->f != NULL) {
        float *to = e->f->position_m + 3 * e->n_vertex;
        to[0] = (float)(p[0] - (double)e->cell[0] * e->tile_m[0]);
        to[1] = (float)(p[1] - (double)e->cell[1] * e->tile_m[1]);
        to[2] = (float)(p[2] + e->z_shift_m);
        if (e->section != NULL) e->section[e->n_vertex] = e->here;
    }
    e->n_vertex++;
    e->n_here++;
}

static void end_piece(struct emitter *e)
{
    if (e->n_here < 2) {
        e->n_vertex -= e->n_here;
    } else {
        if (e->f != NULL) {
            e->f->radius_m[e->n_fiber] = (float)e->strand->radius_m;
            e->f->axis_class[e->n_fiber] = e->strand->axis_class;
            e->f->group[e->n_fiber] = e->group;
            e->f->first_vertex[e->n_fiber + 1] = e->n_vertex;
        }
        e->n_fiber++;
    }
    e->n_here = 0;
}

static long cell_of(const struct emitter *e, const double p[3], int axis)
{
    return (long)floor(p[axis] / e->tile_m[axis]);
}

/* Continues from a to b, and cuts at every face of the mask between them. Returns true if it has cut. */
static bool advance(struct emitter *e, const double a[3], const double b[3])
{
    double from[3] = {a[0], a[1], a[2]};
    bool any = false;
    for (;;) {
        double nearest = 2.0;
        int axis = -1;
        for (int k = 0; k < 2; k++) {
            long there = cell_of(e, b, k);
            if ((e->strand->cut & (k == 0 ? CUT_FACE_X : CUT_FACE_Y)) == 0 || there == e->cell[k]) continue;
            double face = (double)(there > e->cell[k] ? e->cell[k] + 1 : e->cell[k]) * e->tile_m[k];
            double w = b[k] != from[k] ? (face - from[k]) / (b[k] - from[k]) : 0.0;
            if (w < nearest) {
                nearest = w;
                axis = k;
            }
        }
        if (axis < 0) return any;
        any = true;
        for (int k = 0; k < 3; k++) from[k] += nearest * (b[k] - from[k]);
        if (e->n_here > 0) put_vertex(e, from);
        end_piece(e);
        e->cell[axis] += cell_of(e, b, axis) > e->cell[axis] ? 1 : -1;
        put_vertex(e, from);
    }
}

/* Point at w between nodes i and i + 1 of a strand (Catmull-Rom); i may exceed the end of a closed strand. */
static void curve_point(const struct strand_set *s, const struct strand *t, size_t i, double w, double out[3])
{
    double q[4][3];
    for (int k = 0; k < 4; k++) {
        long j = (long)i + k - 1, n = (long)t->n;
        double turn = 0.0;
        if (t->n_period > 0) {
            turn = floor((double)j / (double)n);
            j -= (long)turn * n;
        } else {
            j = j < 0 ? 0 : j >= n ? n - 1 : j;
        }
        for (int a = 0; a < 3; a++) q[k][a] = s->p[t->first + (size_t)j][a] + (a < 2 ? turn * t->shift[a] : 0.0);
    }
    for (int a = 0; a < 3; a++) {
        double m1 = 0.5 * (q[2][a] - q[0][a]), m2 = 0.5 * (q[3][a] - q[1][a]), d = q[2][a] - q[1][a];
        out[a] = q[1][a] + w * (m1 + w * ((3.0 * d - 2.0 * m1 - m2) + w * (m1 + m2 - 2.0 * d)));
    }
}

/* Sets the section of the vertices that follow to that at w between nodes i and i + 1 of an open strand. */
static void set_section(struct emitter *e, const struct strand_set *s, const struct strand *t, size_t i, double w)
{
    if (e->section == NULL) return;
    const double *a = s->axis[t->first + i], *b = s->axis[t->first + (i + 1 < t->n ? i + 1 : i)];
    for (int k = 0; k < 3; k++) e->here.axis[k] = (float)(a[k] + w * (b[k] - a[k]));
    e->here.ratio = (float)t->ratio;
}

/* A closed strand starts at its first cut, so that no piece is split at node 0 as well. */
static size_t first_cut(struct emitter *e, const struct strand_set *s, const struct strand *t)
{
    if (t->n_period == 0 || (t->cut & CUT_FACE_XY) == 0) return 0;
    for (size_t i = 0; i < t->n; i++) {
        double a[3], b[3];
        curve_point(s, t, i, 0.0, a);
        curve_point(s, t, i + 1, 0.0, b);
        for (int k = 0; k < 2; k++)
            if ((t->cut & (k == 0 ? CUT_FACE_X : CUT_FACE_Y)) != 0 && cell_of(e, a, k) != cell_of(e, b, k)) return i;
    }
    return 0;
}

/* Continues from a to b; the part up to the share `cut` of the way belongs to the former group. */
static void advance_past_change(struct emitter *e, const double a[3], const double b[3], double cut)
{
    double at[3];
    for (int x = 0; x < 3; x++) at[x] = a[x] + cut * (b[x] - a[x]);
    advance(e, a, at);
    put_vertex(e, at);
    end_piece(e);
    e->group = e->strand->group;
    put_vertex(e, at);
    advance(e, at, b);
}

static void emit_strand(struct emitter *e, const struct strand_set *s, const struct strand *t, double spacing_m)
{
    e->strand = t;
    bool changes = t->n_period == 0 && t->start_share > 0.0;
    e->group = changes ? t->group_of_start : t->group;
    size_t from = first_cut(e, s, t), n_interval = t->n_period > 0 ? t->n : t->n - 1;
    size_t n_sub = (size_t)fmax(1.0, ceil(t->radius_m / spacing_m)),
           per_period = t->n_period > 0 ? t->n / t->n_period : t->n;
    bool faces = t->n_period > 0 && (t->cut & CUT_FACE_XY) != 0, started = !faces;
    double a[3], b[3];
    curve_point(s, t, from, 0.0, a);
    /* a node outside of a face belongs to the previous tile; open strands stay whole in the tile of their first node */
    for (int k = 0; k < 2; k++)
        e->cell[k] = faces && (t->cut & (k == 0 ? CUT_FACE_X : CUT_FACE_Y)) == 0 ? 0 : cell_of(e, a, k);
    set_section(e, s, t, from, 0.0);
    if (started) put_vertex(e, a);
    /* with faces, once around and then to the first cut again */
    for (size_t i = 0; i < n_interval + (faces ? 1 : 0); i++) {
        for (size_t k = 1; k <= n_sub; k++) {
            curve_point(s, t, from + i, (double)k / (double)n_sub, b);
            set_section(e, s, t, from + i, (double)k / (double)n_sub);
            double step = (double)n_interval * t->start_share * (double)n_sub - (double)(i * n_sub + k - 1);
            bool here = changes && step >= 0.0 && step < 1.0, cut = !here && advance(e, a, b);
            if (here) advance_past_change(e, a, b, step);
            if (cut && started && faces && i == n_interval) { /* closed: advance began the first piece once more */
                e->n_vertex -= e->n_here;
                e->n_here = 0;
                return;
            }
            started = started || cut;
            if (started) put_vertex(e, b);
            for (int x = 0; x < 3; x++) a[x] = b[x];
        }
        if (t->cut == CUT_PERIOD && t->n_period > 0 && (i + 1) % per_period == 0 && i + 1 < n_interval) {
            end_piece(e);
            for (int k = 0; k < 2; k++) e->cell[k] += lround(t->shift[k] / (double)t->n_period / e->tile_m[k]);
            put_vertex(e, a);
        }
    }
    end_piece(e);
}

static void emit_all(struct emitter *e, const struct strand_set *s, double spacing_m)
{
    for (size_t i = 0; i < s->n_strand; i++) emit_strand(e, s, &s->strand[i], spacing_m);
}

/* Fibers of a weave may leave the tile sideways without being cut; each is put into the tile that has most of it. */
static void recentre(struct fiber_set *f)
{
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t a = 0; a < 2; a++) {
            double low = INFINITY, high = -INFINITY;
            for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++) {
                low = fmin(low, (double)f->position_m[3 * k + a]);
                high = fmax(high, (double)f->position_m[3 * k + a]);
            }
            double turns = floor(0.5 * (low + high) / f->tile_size_m[a]);
            if (turns == 0.0) continue;
            for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++)
                f->position_m[3 * k + a] = (float)((double)f->position_m[3 * k + a] - turns * f->tile_size_m[a]);
        }
}

double strand_lowest_m(const struct strand_set *s)
{
    double low = INFINITY;
    for (size_t i = 0; i < s->n_strand; i++)
        for (size_t k = 0; k < s->strand[i].n; k++)
            low = fmin(low, s->p[s->strand[i].first + k][2] - s->strand[i].radius_m);
    return low;
}

status strand_emit(const struct strand_set *s, double spacing_m, double margin_m, struct fiber_set *f,
                   struct error *err)
{
    const double low = strand_lowest_m(s);
    struct emitter count = {.tile_m = {s->tile_m[0], s->tile_m[1]}}, emit = count;
    emit_all(&count, s, spacing_m);
    status st = fiber_set_reserve(f, count.n_fiber, count.n_vertex + 16, err);
    if (st != STATUS_OK) return st;
    emit.f = f;
    emit.z_shift_m = margin_m - low;
    if (s->axis != NULL) {
        emit.section = malloc((count.n_vertex + 16) * sizeof *emit.section);
        if (emit.section == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
    }
    emit_all(&emit, s, spacing_m);
    f->n_vertex = emit.n_vertex;
    f->tile_size_m[0] = s->tile_m[0];
    f->tile_size_m[1] = s->tile_m[1];
    recentre(f);
    if (emit.section != NULL) st = strand_set_sections(emit.section, f, err);
    free(emit.section);
    return st;
}
