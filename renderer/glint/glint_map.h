/* Procedural normal maps of micrometres: periodic, and determined by the seed (000, sections 3.7, 3.12).
 *
 * normal[j * n + i] is (s, t) of the unit normal in the texel (i, j). A smooth map is read between the middles of
 * texels by bicubic interpolation (Catmull-Rom). In a flat one, of flakes, a texel has one normal. */
#ifndef SELVEDGE_RENDERER_GLINT_MAP_H
#define SELVEDGE_RENDERER_GLINT_MAP_H

#include "renderer/glint/glint_option.h"

struct glint_map {
    size_t n; /* a power of two */
    float texel_um;
    bool is_flat;
    float (*normal)[2]; /* n x n */
};

/* o: complete. STATUS_NO_MEMORY. */
status glint_map_make(const struct glint_option *o, struct glint_map *m, struct error *err);
void glint_map_release(struct glint_map *m);

/* Normal at a place in texels. jacobian (may be NULL): d s / d u, d s / d v, d t / d u, d t / d v, for a texel. */
void glint_map_at(const struct glint_map *m, const double place[2], float normal[2], float jacobian[4]);

/* Makes normals of slopes dh/du, dh/dv, in place: -slope / sqrt(1 + slope^2). */
void glint_map_normals_of_slopes(struct glint_map *m);

/* The kinds of maps; they write slopes into m->normal. */
status glint_noise_slopes(const struct glint_option *o, double slope, struct glint_map *m, struct error *err);
status glint_scratch_slopes(const struct glint_option *o, struct glint_map *m, struct error *err);
status glint_flake_slopes(const struct glint_option *o, struct glint_map *m, struct error *err);

#endif
