#include "renderer/scene/scene.h"
#include "base/ranks/unique_number.h"
#include "renderer/scene/bent_scene.h"
#include "renderer/scene/scene_ellipse.h"
#include "renderer/scene/scene_embree.h"
#include "renderer/scene/scene_ends.h"
#include "renderer/scene/scene_glint_data.h"
#include "renderer/scene/scene_grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MM_PER_M 1e3

/* Embree's round curves are computed in single precision relative to a segment's length: one of 100 radii is wrong by
 * 1e-3 of its radius, and 15 % of the rays that leave it outwards seem to hit it again. Longer segments are cut into
 * pieces of this many radii (5e-6). */
static const double longest_segment_radii = 10;

static double distance(const float *p, const float *q)
{
    double x = (double)q[0] - (double)p[0], y = (double)q[1] - (double)p[1], z = (double)q[2] - (double)p[2];
    return sqrt(x * x + y * y + z * z);
}

/* As a double: a length in a wrong unit gives more than an integer holds. */
static double n_piece(const float *p, const float *q, float radius_m)
{
    return fmax(1, ceil(distance(p, q) / (longest_segment_radii * (double)radius_m)));
}

/* The smaller radius of both ends of a segment of fiber i. */
static float thinner_m(const struct fiber_set *f, size_t i, size_t vertex)
{
    return fminf(fiber_radius_m(f, i, vertex), fiber_radius_m(f, i, vertex + 1));
}

static status too_far(const double mm[2], int axis, double tile_mm, struct error *err)
{
    return error_set(err, STATUS_INVALID,
                     "cannot build scene: fibers reach from %g to %g mm along %s, too far beyond the tile of %g mm",
                     mm[0], mm[1], axis == 0 ? "x" : "y", tile_mm);
}

/* Axes that reach farther than the widest block (choose_block), before their segments are cut into pieces. */
static status check_reach(const struct fiber_set *f, struct error *err)
{
    for (int a = 0; a < 2; a++) {
        double mm[2] = {INFINITY, -INFINITY}, tile_mm = f->tile_size_m[a] * MM_PER_M;
        for (size_t v = 0; v < f->n_vertex; v++) {
            double x_mm = (double)f->position_m[3 * v + (size_t)a] * MM_PER_M;
            mm[0] = fmin(mm[0], x_mm);
            mm[1] = fmax(mm[1], x_mm);
        }
        if (mm[0] < -SCENE_MAX_HALF_BLOCK * tile_mm || mm[1] > (SCENE_MAX_HALF_BLOCK + 1) * tile_mm)
            return too_far(mm, a, tile_mm, err);
    }
    return STATUS_OK;
}

/* Room that copying needs; STATUS_INVALID for a fiber too thin for its tile, STATUS_TOO_LARGE. */
static status count_vertices(const struct fiber_set *f, size_t *n, struct error *err)
{
    double tile_m = fmax(f->tile_size_m[0], f->tile_size_m[1]), sum = (double)f->n_vertex;
    for (size_t i = 0; i < f->n_fiber; i++) {
        if ((double)f->radius_m[i] < SCENE_SMALLEST_RADIUS_OF_TILE * tile_m)
            return error_set_field(err, STATUS_INVALID, "radius_m",
                                   "cannot build scene: fiber %zu has a radius of %g m on a tile of %g m, rays need at "
                                   "least 1/%.0f of it",
                                   i, (double)f->radius_m[i], tile_m, 1 / SCENE_SMALLEST_RADIUS_OF_TILE);
        for (size_t v = f->first_vertex[i]; v + 1 < f->first_vertex[i + 1]; v++)
            sum += n_piece(f->position_m + 3 * v, f->position_m + 3 * (v + 1), thinner_m(f, i, v)) - 1;
    }
    if (!(sum <= UINT32_MAX))
        return error_set(err, STATUS_TOO_LARGE, "cannot build scene: %.4g vertices, at most %u can be numbered", sum,
                         UINT32_MAX);
    *n = (size_t)sum;
    return STATUS_OK;
}

/* Embree is wrong by up to a tenth of a radius on segments of a few thousandths of it (single precision). Vertices that
 * are nearer than this part of a radius are one. */
static const float shortest_segment_radii = 0.05f;

/* The point at t from p to q, in millimetres and with z from the top. */
static struct scene_vertex vertex_at(const float *p, const float *q, double t, double z_max_m, float radius)
{
    double at[3];
    for (int a = 0; a < 3; a++) at[a] = (1 - t) * (double)p[a] + t * (double)q[a];
    return (struct scene_vertex){(float)(at[0] * MM_PER_M), (float)(at[1] * MM_PER_M),
                                 (float)((at[2] - z_max_m) * MM_PER_M), radius};
}

/* Adds a vertex unless it is as good as the fiber's last one. The end of a fiber takes the place of that, because its
 * continuation begins there. */
static void add_vertex(struct scene *s, size_t first, struct scene_vertex x, bool is_end)
{
    if (s->n_vertex > first) {
        const struct scene_vertex *last = &s->vertex[s->n_vertex - 1];
        float dx = x.x - last->x, dy = x.y - last->y, dz = x.z - last->z;
        const float near = shortest_segment_radii * x.radius;
        if (dx * dx + dy * dy + dz * dz < near * near) {
            if (!is_end || s->n_vertex == first + 1) return;
            s->n_vertex--;
        }
    }
    s->vertex[s->n_vertex++] = x;
}

/* Radius at t from vertex v of fiber i to the next. */
static float radius_mm(const struct fiber_set *f, size_t i, size_t v, double t)
{
    const float a = fiber_radius_m(f, i, v), b = t > 0 ? fiber_radius_m(f, i, v + 1) : a;
    return (a + (float)t * (b - a)) * (float)MM_PER_M;
}

static bool is_film(const struct film_groups *films, uint8_t group)
{
    return films->n > 0 && group >= films->first_group;
}

/* Whether the fibers that are no films have sections that are flat in the mean over their vertices. */
static bool has_flat_sections(const struct fiber_set *f, const struct film_groups *films)
{
    double sum = 0, n = 0;
    for (size_t i = 0; i < f->n_fiber && f->shape != NULL; i++)
        for (size_t v = f->first_vertex[i]; v < f->first_vertex[i + 1] && !is_film(films, f->group[i]); v++) {
            if (!fiber_shape_has_section(&f->shape[v])) continue;
            sum += (double)f->shape[v].ratio;
            n++;
        }
    return sum > FIBER_RATIO_FLAT * n;
}

/* Height of the surface above the axis at a vertex: of a section as on a level fiber, which reaches farthest. */
static double reach_m(const struct scene *s, const struct fiber_set *f, size_t i, size_t v)
{
    if (!s->shows_sections && !is_film(&s->films, f->group[i])) return (double)fiber_radius_m(f, i, v);
    const struct fiber_shape *y = &f->shape[v];
    const double ratio = (double)y->ratio, up2 = (double)(y->long_axis[2] * y->long_axis[2]);
    return (double)y->radius * sqrt(ratio * up2 + (1 - up2) / ratio);
}

/* Lowest and highest z of the surfaces. */
static void z_range(const struct scene *s, const struct fiber_set *f, double *z_min_m, double *z_max_m)
{
    fiber_set_z_range_m(f, z_min_m, z_max_m);
    if (!s->shows_sections && s->films.n == 0) return;
    *z_min_m = INFINITY;
    *z_max_m = -INFINITY;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t v = f->first_vertex[i]; v < f->first_vertex[i + 1]; v++) {
            const double z = (double)f->position_m[3 * v + 2], reach = reach_m(s, f, i, v);
            *z_min_m = fmin(*z_min_m, z - reach);
            *z_max_m = fmax(*z_max_m, z + reach);
        }
}

/* Gives the last vertex the section at vertex v of fiber i of the set; a disc where the section is not shown. */
static void add_section(struct scene *s, const struct fiber_set *f, size_t i, size_t v)
{
    if (s->long_axis != NULL) memcpy(s->long_axis[s->n_vertex - 1], f->shape[v].long_axis, sizeof *s->long_axis);
    if (s->ratio == NULL) return;
    s->ratio[s->n_vertex - 1] = s->shows_sections || is_film(&s->films, f->group[i]) ? f->shape[v].ratio : 1;
}

static void add_segments(struct scene *s, size_t first, size_t i_fiber)
{
    for (size_t v = first; v + 1 < s->n_vertex; v++) {
        s->segment_vertex[s->n_segment] = (uint32_t)v;
        s->segment_fiber[s->n_segment] = (uint32_t)i_fiber;
        s->segment_flag[s->n_segment++] = (unsigned char)((v > first ? RTC_CURVE_FLAG_NEIGHBOR_LEFT : 0) |
                                                          (v + 2 < s->n_vertex ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : 0));
    }
}

/* Vertices in millimetres, z from the top; repeated points are left out, and fibers of one point with them. */
static status copy_fibers(struct scene *s, const struct fiber_set *f, struct error *err)
{
    double z_min_m, z_max_m;
    size_t n = 0;
    status st = check_reach(f, err);
    if (st == STATUS_OK) st = count_vertices(f, &n, err);
    if (st != STATUS_OK) return st;
    z_range(s, f, &z_min_m, &z_max_m);
    s->bottom_mm = (float)((z_min_m - z_max_m) * MM_PER_M);
    s->vertex = malloc(n * sizeof *s->vertex);
    s->segment_vertex = malloc(n * sizeof *s->segment_vertex);
    s->segment_fiber = malloc(n * sizeof *s->segment_fiber);
    s->segment_flag = malloc(n);
    if (s->vertex == NULL || s->segment_vertex == NULL || s->segment_fiber == NULL || s->segment_flag == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu vertices", n);
    if (s->has_sections || s->films.n > 0) {
        const bool shown = s->shows_sections || s->films.n > 0;
        s->long_axis = malloc(n * sizeof *s->long_axis);
        if (shown) s->ratio = malloc(n * sizeof *s->ratio);
        if (s->long_axis == NULL || (shown && s->ratio == NULL))
            return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu sections", n);
    }
    for (size_t i = 0; i < f->n_fiber; i++) {
        size_t first = s->n_vertex, v = f->first_vertex[i];
        const float *start = f->position_m + 3 * v;
        add_vertex(s, first, vertex_at(start, start, 0, z_max_m, radius_mm(f, i, v, 0)), false);
        add_section(s, f, i, v);
        for (; v + 1 < f->first_vertex[i + 1]; v++) {
            const float *p = f->position_m + 3 * v, *q = p + 3;
            size_t pieces = (size_t)n_piece(p, q, thinner_m(f, i, v));
            for (size_t k = 1; k <= pieces; k++) {
                const double t = (double)k / (double)pieces;
                const bool is_end = k == pieces && v + 2 == f->first_vertex[i + 1];
                add_vertex(s, first, vertex_at(p, q, t, z_max_m, radius_mm(f, i, v, t)), is_end);
                add_section(s, f, i, t < 0.5 ? v : v + 1);
            }
        }
        if (s->n_vertex - first < 2)
            s->n_vertex = first;
        else
            add_segments(s, first, i);
    }
    if (s->n_segment == 0)
        return error_set(err, STATUS_INVALID, "cannot build scene: no fiber longer than its points' rounding");
    return STATUS_OK;
}

static status copy_groups(struct scene *s, const struct fiber_set *f, struct error *err)
{
    const size_t n_group = fiber_set_n_group(f);
    s->n_group = n_group;
    if (s->films.n > 0 && s->n_group > s->films.first_group) s->n_group = s->films.first_group;
    if (s->n_group == 0) s->n_group = 1;
    if (n_group == 1) return STATUS_OK;
    s->segment_group = malloc(s->n_segment);
    if (s->segment_group == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu segments", s->n_segment);
    for (size_t i = 0; i < s->n_segment; i++) s->segment_group[i] = f->group[s->segment_fiber[i]];
    return STATUS_OK;
}

/* How far a local origin in the centre tile may travel before the block's copies no longer cover it. */
static status choose_block(struct scene *s, const struct fiber_set *f, struct error *err)
{
    float lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (size_t v = 0; v < s->n_vertex; v++) {
        float p[2] = {s->vertex[v].x, s->vertex[v].y}, r = s->vertex[v].radius;
        if (s->ratio != NULL) r *= sqrtf(s->ratio[v]);
        for (int a = 0; a < 2; a++) {
            lo[a] = fminf(lo[a], p[a] - r);
            hi[a] = fmaxf(hi[a], p[a] + r);
        }
    }
    for (int a = 0; a < 2; a++) {
        double tile = f->tile_size_m[a] * MM_PER_M;
        s->tile_mm[a] = tile;
        double reach = fmax(0.5 * tile, -3.0 * (double)s->bottom_mm); /* beyond the centre tile */
        int h = 1;
        while (h < SCENE_MAX_HALF_BLOCK &&
               ((h + 1) * tile + (double)lo[a] < tile + reach || (h + 1) * tile - (double)hi[a] < reach))
            h++;
        s->half_block[a] = h;
        s->inset_low_mm[a] = (float)((double)hi[a] - (h + 1) * tile);
        s->inset_high_mm[a] = (float)((double)lo[a] + (h + 1) * tile);
        if (s->inset_low_mm[a] > -0.25f * (float)tile || s->inset_high_mm[a] < 1.25f * (float)tile)
            return too_far((const double[2]){(double)lo[a], (double)hi[a]}, a, tile, err);
    }
    return STATUS_OK;
}

/* Arc lengths and surfaces for films with glints. */
static status add_glints(struct scene *s, struct error *err)
{
    if (!scene_has_glints(&s->films)) return STATUS_OK;
    s->arc_mm = calloc(s->n_vertex, sizeof *s->arc_mm);
    s->glints = scene_glints_new();
    if (s->arc_mm == NULL || s->glints == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot build scene: out of memory");
    for (size_t i = 0; i < s->n_segment; i++) {
        const size_t v = s->segment_vertex[i];
        const struct scene_vertex *x = &s->vertex[v];
        const float d[3] = {x[1].x - x->x, x[1].y - x->y, x[1].z - x->z};
        s->arc_mm[v + 1] = s->arc_mm[v] + sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    }
    return STATUS_OK;
}

status scene_build(struct scene *s, struct error *err)
{
    status st = scene_ends_new(s, &s->ends, err);
    if (st == STATUS_OK) st = add_glints(s, err);
    s->number = unique_number();
    if (s->ratio == NULL) return st == STATUS_OK ? scene_grid_new(s, &s->grid, err) : st;
    if (st == STATUS_OK) st = scene_ellipse_fill(s, err);
    return st == STATUS_OK ? scene_embree_build(s, err) : st;
}

status scene_new(const struct fiber_set *f, const struct scene_option *o, struct scene **scene, struct error *err)
{
    status st = fiber_set_validate(f, err);
    if (st != STATUS_OK) return st;
    struct scene *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot build scene: out of memory");
    s->black_sheet = o->black_sheet;
    s->no_avx512 = o->no_avx512;
    if (o->films != NULL && f->shape != NULL) s->films = *o->films;
    s->has_sections = has_flat_sections(f, &s->films);
    s->shows_sections = s->has_sections && o->sections;
    st = copy_fibers(s, f, err);
    if (st == STATUS_OK) st = copy_groups(s, f, err);
    if (st == STATUS_OK) st = choose_block(s, f, err);
    if (st == STATUS_OK) st = scene_build(s, err);
    if (st == STATUS_OK)
        *scene = s;
    else
        scene_free(s);
    return st;
}

status scene_lift(const struct scene *flat, struct scene **lifted, struct error *err)
{
    struct scene *s = flat->bent == NULL ? malloc(sizeof *s) : NULL;
    if (flat->bent != NULL) return error_set(err, STATUS_INVALID, "cannot take the sheet from under a bent cloth");
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot copy a scene: out of memory");
    memcpy(s, flat, sizeof *s);
    s->black_sheet = false;
    s->is_lifted = true;
    s->number = unique_number();
    *lifted = s;
    return STATUS_OK;
}

void scene_free(struct scene *s)
{
    if (s == NULL) return;
    if (s->is_lifted && s->bent == NULL) {
        free(s);
        return;
    }
    if (s->bent != NULL) {
        bent_free(s); /* all else belongs to the flat scene */
        return;
    }
    scene_embree_free(s);
    free(s->vertex);
    free(s->segment_vertex);
    free(s->segment_fiber);
    free(s->segment_flag);
    free(s->segment_group);
    free(s->long_axis);
    free(s->ratio);
    free(s->arc_mm);
    scene_glints_free(s->glints);
    free(s->ellipse);
    scene_ends_free(s->ends);
    scene_grid_free(s->grid);
    free(s);
}

size_t scene_memory_bytes(const struct scene *s)
{
    if (s->bent != NULL) return bent_memory_bytes(s);
    long long device = atomic_load(&s->device_bytes);
    return sizeof *s + (device > 0 ? (size_t)device : 0) +
           s->n_vertex * (sizeof *s->vertex + (s->long_axis != NULL ? sizeof *s->long_axis : 0) +
                          (s->ratio != NULL ? sizeof *s->ratio : 0)) +
           (s->ellipse != NULL ? s->n_segment * sizeof *s->ellipse : 0) + s->ends->n * sizeof *s->ends->link +
           (s->grid != NULL ? scene_grid_bytes(s) : 0) +
           s->n_segment * (sizeof *s->segment_vertex + sizeof *s->segment_fiber + 1 + (s->segment_group != NULL));
}

size_t scene_n_segment(const struct scene *s) { return s->n_segment; }
uint32_t scene_fiber_of(const struct scene *s, uint32_t i_segment) { return s->segment_fiber[i_segment]; }
uint32_t scene_group_of(const struct scene *s, uint32_t i_segment) { return scene_group_at(s, i_segment); }
size_t scene_n_group(const struct scene *s) { return s->n_group; }
void scene_tile_mm(const struct scene *s, double tile_mm[2])
{
    for (int a = 0; a < 2; a++) tile_mm[a] = s->tile_mm[a];
}
bool scene_has_black_sheet(const struct scene *s) { return s->black_sheet; }
double scene_thickness_mm(const struct scene *s) { return -(double)s->bottom_mm; }
