/* Distances of the points of a lattice to the nearest segment (segment_bricks.h). */
#include "geometry/fibers/lines/segment_bricks.h"

#include "base/lanes.h"

#include <math.h>

/* A segment seen from the lattice: the numbers that the inner loops need. */
struct view {
    float u[3], inverse2;       /* b - a, 1 / |u|^2 */
    float inverse;              /* 1 / |u| */
    float from_voxel, to_voxel; /* slab along u, measured from a in voxels */
    float across[3];            /* distance by which points at `reach` may lie beyond the segment's box on each axis */
};

static struct view view_of(const struct segment *g, float reach)
{
    struct view w = {.u = {g->b[0] - g->a[0], g->b[1] - g->a[1], g->b[2] - g->a[2]}};
    float length2 = w.u[0] * w.u[0] + w.u[1] * w.u[1] + w.u[2] * w.u[2], length = sqrtf(length2);
    w.inverse2 = length2 > 0.0f ? 1.0f / length2 : 0.0f;
    w.inverse = sqrtf(w.inverse2);
    w.from_voxel = g->is_first || !(length2 > 0.0f) ? -reach : -1.0f;
    w.to_voxel = length + (g->is_last || !(length2 > 0.0f) ? reach : 1.0f);
    for (int a = 0; a < 3; a++) {
        float c = length2 > 0.0f ? w.u[a] / length : 0.0f;
        w.across[a] = g->is_first || g->is_last
                          ? reach
                          : fminf(reach, reach * sqrtf(fmaxf(0.0f, 1.0f - c * c)) + fabsf(c) + 0.1f);
    }
    return w;
}

/* Finds the points of the lattice along each axis that the segment may be nearest to. Returns false if there are
 * none. */
static bool lattice_range(const struct point_lattice *l, const struct segment *g, const struct view *w, size_t from[3],
                          size_t to[3])
{
    for (int a = 0; a < 3; a++) {
        float lo = (fminf(g->a[a], g->b[a]) - w->across[a] - l->origin[a]) / l->spacing - 0.5f;
        float hi = (fmaxf(g->a[a], g->b[a]) + w->across[a] - l->origin[a]) / l->spacing - 0.5f;
        if (hi < 0.0f || lo > (float)(l->n[a] - 1)) return false;
        from[a] = lo <= 0.0f ? 0 : (size_t)ceilf(lo);
        to[a] = hi >= (float)(l->n[a] - 1) ? l->n[a] - 1 : (size_t)hi;
        if (from[a] > to[a]) return false;
    }
    return true;
}

/* Points of a lattice that follow each other along x: (x0 + i spacing, y, z) for i < n, relative to the segment's
 * end a. */
struct lattice_row {
    float x0, spacing, y, z;
    size_t n;
};

/* Largest |x| in a row. */
static float reach_of_row(const struct lattice_row *r)
{
    return fmaxf(fabsf(r->x0), fabsf(r->x0 + r->spacing * (float)r->n));
}

/* Finds the part from .. to - 1 of a row that lies in the slab. Returns false if there is none. */
static bool slab_range(const struct view *w, const struct lattice_row *r, size_t *from, size_t *to)
{
    float c = w->u[0] * w->inverse, fixed = (r->y * w->u[1] + r->z * w->u[2]) * w->inverse;
    *from = 0;
    *to = r->n;
    if (fabsf(c) < 0.05f)
        return fixed > w->from_voxel - reach_of_row(r) * 0.05f && fixed < w->to_voxel + reach_of_row(r) * 0.05f;
    float x0 = (w->from_voxel - fixed) / c, x1 = (w->to_voxel - fixed) / c;
    float lo = (fminf(x0, x1) - r->x0) / r->spacing, hi = (fmaxf(x0, x1) - r->x0) / r->spacing;
    if (hi < 0.0f || lo > (float)(r->n - 1)) return false;
    if (lo > 0.0f) *from = (size_t)ceilf(lo);
    if (hi < (float)(r->n - 1)) *to = (size_t)hi + 1;
    return *from < *to;
}

static const lanes STEP = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};

/* Gives the points of a row to the segment where it is the nearest so far. LANES points beyond the row are read too,
 * and written as they are. */
static void stamp_row(const struct view *w, const struct lattice_row *r, uint32_t id, float *distance2,
                      uint32_t *nearest)
{
    const float along_y = r->y * w->u[1], along_z = r->z * w->u[2];
    const lanes zero = {0.0f}, one = zero + 1.0f;
    for (size_t i = 0; i < r->n; i += LANES) {
        const lanes x = r->x0 + (STEP + (float)(int)i) * r->spacing;
        lanes t = (x * w->u[0] + along_y + along_z) * w->inverse2;
        t = lanes_choose(t < zero, zero, t);
        t = lanes_choose(t > one, one, t);
        const lanes dx = x - t * w->u[0], dy = r->y - t * w->u[1], dz = r->z - t * w->u[2];
        const lanes d2 = dx * dx + dy * dy + dz * dz, old = *(const lanes *)(distance2 + i);
        const lane_mask take = (d2 < old) & (STEP < (float)(int)(r->n - i));
        lane_mask *own = (lane_mask *)(nearest + i);
        *(lanes *)(distance2 + i) = lanes_choose(take, d2, old);
        *own = (*own & ~take) | (take & (int32_t)id);
    }
}

/* Fine lattices are looked at in blocks of LANES x BLOCK x BLOCK points, rows of LANES blocks at a time. A segment is
 * compared with the points of a block only if it may be the nearest of one of them: the nearest segment to the middle
 * of the block is nearer than any that is farther from it by the diagonal. MARGIN: voxels for bends of lines. */
enum { BLOCK = 4, MOST_BLOCKS = 16 };
static const float MARGIN = 0.5f;

struct blocks {
    float diagonal;                          /* voxels, with the margin */
    lanes nearest[MOST_BLOCKS][MOST_BLOCKS]; /* distance of the middles; its square at first */
};

static bool has_blocks(const struct point_lattice *l)
{
    return l->spacing < 0.5f && l->n[0] <= LANES * LANES && l->n[1] <= BLOCK * MOST_BLOCKS &&
           l->n[2] <= BLOCK * MOST_BLOCKS;
}

/* Squared distances of a segment from the middles of a row of blocks. */
static lanes middle_distances(const struct point_lattice *l, const struct segment *g, const struct view *w, size_t by,
                              size_t bz)
{
    const lanes zero = {0.0f}, one = zero + 1.0f;
    const float y = l->origin[1] + l->spacing * (float)(BLOCK * by + BLOCK / 2) - g->a[1];
    const float z = l->origin[2] + l->spacing * (float)(BLOCK * bz + BLOCK / 2) - g->a[2];
    const lanes x = l->origin[0] + l->spacing * ((float)LANES * STEP + (float)(LANES / 2)) - g->a[0];
    lanes t = (x * w->u[0] + y * w->u[1] + z * w->u[2]) * w->inverse2;
    t = lanes_choose(t < zero, zero, t);
    t = lanes_choose(t > one, one, t);
    const lanes dx = x - t * w->u[0], dy = y - t * w->u[1], dz = z - t * w->u[2];
    return dx * dx + dy * dy + dz * dz;
}

/* Finds the distance of the nearest segment from the middles of all blocks. */
static void nearest_to_blocks(const struct segment_bricks *s, size_t i_brick, const struct point_lattice *l,
                              struct blocks *b)
{
    const lanes zero = {0.0f};
    b->diagonal = l->spacing * sqrtf((float)(LANES * LANES + 2 * BLOCK * BLOCK)) + MARGIN;
    for (size_t z = 0; z < MOST_BLOCKS; z++)
        for (size_t y = 0; y < MOST_BLOCKS; y++) b->nearest[z][y] = zero + s->reach * s->reach;
    for (size_t e = s->first[i_brick]; e < s->first[i_brick + 1]; e++) {
        const struct segment *g = &s->segment[s->index[e]];
        const struct view w = view_of(g, s->reach);
        size_t from[3], to[3];
        if (!lattice_range(l, g, &w, from, to)) continue;
        for (size_t z = from[2] / BLOCK; z <= to[2] / BLOCK; z++)
            for (size_t y = from[1] / BLOCK; y <= to[1] / BLOCK; y++) {
                const lanes d2 = middle_distances(l, g, &w, y, z), old = b->nearest[z][y];
                b->nearest[z][y] = lanes_choose(d2 < old, d2, old);
            }
    }
    for (size_t z = 0; z < MOST_BLOCKS; z++)
        for (size_t y = 0; y < MOST_BLOCKS * LANES; y++)
            b->nearest[z][y / LANES][y % LANES] = sqrtf(b->nearest[z][y / LANES][y % LANES]);
}

/* A segment that is compared with the points of a lattice. */
struct stamp {
    const struct point_lattice *l;
    const struct segment *g;
    const struct view *w;
    uint32_t id;
    float *distance2;
    uint32_t *nearest;
};

/* Gives points of a block, in rows from .. to, to a segment where it is the nearest so far. x0: first of the block. */
static void stamp_block(const struct stamp *s, size_t x0, const size_t from[2], const size_t to[2])
{
    const struct point_lattice *l = s->l;
    const float *a = s->g->a, *u = s->w->u;
    const lanes zero = {0.0f}, one = zero + 1.0f;
    const lanes x = l->origin[0] + l->spacing * ((float)x0 + 0.5f) - a[0] + l->spacing * STEP;
    const lane_mask inside = STEP < (float)(int)(l->n[0] - x0);
    for (size_t k = from[1]; k <= to[1]; k++)
        for (size_t j = from[0]; j <= to[0]; j++) {
            const float y = l->origin[1] + ((float)j + 0.5f) * l->spacing - a[1];
            const float z = l->origin[2] + ((float)k + 0.5f) * l->spacing - a[2];
            const size_t at = (k * l->n[1] + j) * l->n[0] + x0;
            const lanes dot = x * u[0] + y * u[1] + z * u[2], along = dot * s->w->inverse;
            lanes t = dot * s->w->inverse2;
            t = lanes_choose(t < zero, zero, t);
            t = lanes_choose(t > one, one, t);
            const lanes dx = x - t * u[0], dy = y - t * u[1], dz = z - t * u[2];
            const lanes d2 = dx * dx + dy * dy + dz * dz, old = *(const lanes *)(s->distance2 + at);
            const lane_mask take = (d2 < old) & inside & (along > s->w->from_voxel) & (along < s->w->to_voxel);
            lane_mask *own = (lane_mask *)(s->nearest + at);
            *(lanes *)(s->distance2 + at) = lanes_choose(take, d2, old);
            *own = (*own & ~take) | (take & (int32_t)s->id);
        }
}

/* Compares a segment with the blocks that it may be nearest in. from, to: points that it may be nearest to. */
static void stamp_blocks(const struct stamp *s, const struct blocks *b, const size_t from[3], const size_t to[3])
{
    for (size_t z = from[2] / BLOCK; z <= to[2] / BLOCK; z++)
        for (size_t y = from[1] / BLOCK; y <= to[1] / BLOCK; y++) {
            const lanes far = b->nearest[z][y] + b->diagonal;
            const lane_mask near = middle_distances(s->l, s->g, s->w, y, z) <= far * far;
            const size_t y0 = y * BLOCK, z0 = z * BLOCK, y1 = y0 + BLOCK - 1, z1 = z0 + BLOCK - 1;
            const size_t first[2] = {y0 > from[1] ? y0 : from[1], z0 > from[2] ? z0 : from[2]};
            const size_t last[2] = {y1 < to[1] ? y1 : to[1], z1 < to[2] ? z1 : to[2]};
            for (size_t i = from[0] / LANES; i <= to[0] / LANES; i++)
                if (near[i]) stamp_block(s, i * LANES, first, last);
        }
}

void segment_distances(const struct segment_bricks *s, size_t i_brick, const struct point_lattice *l, float *distance2,
                       uint32_t *nearest)
{
    const size_t n_point = l->n[0] * l->n[1] * l->n[2];
    const bool fine = has_blocks(l);
    struct blocks blocks;
    for (size_t i = 0; i < n_point; i++) distance2[i] = s->reach * s->reach;
    for (size_t i = 0; i < n_point; i++) nearest[i] = UINT32_MAX;
    if (fine) nearest_to_blocks(s, i_brick, l, &blocks);
    for (size_t e = s->first[i_brick]; e < s->first[i_brick + 1]; e++) {
        const struct segment *g = &s->segment[s->index[e]];
        size_t from[3], to[3];
        const struct view w = view_of(g, s->reach);
        if (!lattice_range(l, g, &w, from, to)) continue;
        const struct stamp stamp = {l, g, &w, s->index[e], distance2, nearest};
        if (fine) stamp_blocks(&stamp, &blocks, from, to);
        if (fine) continue;
        const float px = l->origin[0] + ((float)from[0] + 0.5f) * l->spacing - g->a[0];
        for (size_t k = from[2]; k <= to[2]; k++)
            for (size_t j = from[1]; j <= to[1]; j++) {
                size_t at = (k * l->n[1] + j) * l->n[0] + from[0], i0, i1;
                struct lattice_row r = {.x0 = px,
                                        .spacing = l->spacing,
                                        .y = l->origin[1] + ((float)j + 0.5f) * l->spacing - g->a[1],
                                        .z = l->origin[2] + ((float)k + 0.5f) * l->spacing - g->a[2],
                                        .n = to[0] - from[0] + 1};
                if (!slab_range(&w, &r, &i0, &i1)) continue;
                r.x0 = px + (float)i0 * l->spacing;
                r.n = i1 - i0;
                stamp_row(&w, &r, s->index[e], distance2 + at + i0, nearest + at + i0);
            }
    }
}
