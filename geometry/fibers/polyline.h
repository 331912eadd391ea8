/* Sets of polylines that grow while fibers are traced. Positions are in voxels of the cloth frame: the centre of
 * voxel (i, j, k) is (i + 1/2, j + 1/2, k + 1/2). */
#ifndef SELVEDGE_GEOMETRY_POLYLINE_H
#define SELVEDGE_GEOMETRY_POLYLINE_H

#include "base/status.h"
#include "geometry/fibers/fiber_shape.h"

#include <stdbool.h>
#include <stdint.h>

struct polyline_set {
    size_t n_line, n_vertex, line_capacity, vertex_capacity;
    size_t *first; /* n_line + 1 entries */
    float (*vertex)[3];
    uint8_t *axis; /* per line: index of the subvolume (slice frame) it was found in; later its axis class */
    float *radius; /* per line: radius of the fiber, voxels; 0 while it is not known */
    struct fiber_shape *shape; /* per vertex: measured sections, whose mean radius is the line's; NULL: none */
};

void polyline_set_init(struct polyline_set *p);
void polyline_set_release(struct polyline_set *p);
/* polyline_begin starts a line of unknown radius, polyline_begin_like one with the axis and radius of another line, and
 * polyline_add adds a vertex to the last line. STATUS_NO_MEMORY; STATUS_TOO_LARGE at 2^32 vertices. */
status polyline_begin(struct polyline_set *p, uint8_t axis, struct error *err);
status polyline_begin_like(struct polyline_set *p, const struct polyline_set *from, size_t line, struct error *err);
status polyline_add(struct polyline_set *p, const float x[3], struct error *err);
/* Gives every vertex a disc of the radius of its line. Vertices that are added later begin as discs of no radius.
 * STATUS_NO_MEMORY. */
status polyline_shapes_init(struct polyline_set *p, struct error *err);
/* Makes the mean radius of each line's sections equal to the line's radius, where both were changed apart. */
void polyline_shapes_follow(struct polyline_set *p, bool scale);
/* Copies vertices i .. end - 1 (indices in from->vertex) of a line of `from` as a new line, with their sections. */
status polyline_add_part(struct polyline_set *p, const struct polyline_set *from, size_t line, size_t i, size_t end,
                         struct error *err);
/* Adds the lines of `from` to p without the marked vertices (one mark for each), in pieces of at least min_vertex.
 * origin: NULL, or the vertex of `from` that each added one comes from (room for from->n_vertex). */
status polylines_without(const struct polyline_set *from, const bool *mark, size_t min_vertex, struct polyline_set *p,
                         size_t *origin, struct error *err);
/* Unit tangent at vertex i of a line, by the difference of the vertices `reach` before and after it, or of its ends. */
void polyline_tangent(const struct polyline_set *p, size_t line, size_t i, size_t reach, float t[3]);
static inline size_t polyline_length(const struct polyline_set *p, size_t i) { return p->first[i + 1] - p->first[i]; }

/* Radius in the middle of the segment of a line that begins at vertex i. */
static inline float polyline_segment_radius(const struct polyline_set *p, size_t line, size_t i)
{
    return p->shape != NULL ? 0.5f * (p->shape[i].radius + p->shape[i + 1].radius) : p->radius[line];
}

/* The vertices sorted by the cells of a grid, for neighbour searches. */
struct vertex_grid {
    float cell; /* edge, voxels */
    size_t n[3];
    size_t *first;     /* index in `vertex` of the first of each cell (x fastest), and one entry more */
    uint32_t *vertex;  /* index into polyline_set.vertex */
    uint32_t *line_of; /* of each vertex */
};

/* Makes the grid over a volume of n_voxel. Vertices outside of it are put into the cells at its faces.
 * STATUS_NO_MEMORY. */
status vertex_grid_init(struct vertex_grid *g, const struct polyline_set *p, const size_t n_voxel[3], float cell,
                        struct error *err);
void vertex_grid_release(struct vertex_grid *g);
/* Finds the cells from[a]..to[a] (inclusive) that a ball of radius r about x touches. */
void vertex_grid_range(const struct vertex_grid *g, const float x[3], float r, size_t from[3], size_t to[3]);

#endif
