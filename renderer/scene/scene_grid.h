/* Where the round fibers of a tile are: a plain grid of cells over the tile, each with the segments that reach into it.
 * Rays in a cloth are short, a few diameters of a fiber, and start where their cell is known, so walking from cell to
 * cell is quicker than going down a tree. The grid repeats with the tile. Inside of struct scene.
 */
#ifndef SELVEDGE_RENDERER_SCENE_GRID_H
#define SELVEDGE_RENDERER_SCENE_GRID_H

#include "renderer/scene/scene_data.h"

struct scene_visitor;

struct scene_grid {
    int n[3];
    float low_mm[3], cell_mm[3], per_mm[3]; /* per_mm: 1 / cell_mm */
    uint32_t *first;                        /* of each cell, its first entry; one more */
    uint32_t *entry;    /* first vertex of a segment, and the number of its shift in the upper bits */
    unsigned shift_bit; /* at which the number of the shift begins */
    uint32_t
        begin_bit; /* of segments at which a fiber begins: others leave the ball of their joint to the one before */
    uint32_t vertex_mask, here;   /* here: the upper bits of a segment that is not shifted */
    uint32_t *segment_of;         /* of each vertex that a segment begins at */
    int shift_low[2], n_shift[2]; /* tiles from the copy of the cell to the coordinates of the segment */
    float (*shift_mm)[2];
};

/* STATUS_NO_MEMORY, STATUS_TOO_LARGE. */
status scene_grid_new(const struct scene *s, struct scene_grid **grid, struct error *err);
void scene_grid_free(struct scene_grid *g);
size_t scene_grid_bytes(const struct scene *s);

/* The number of a cell: cells above each other are neighbours in memory, because paths go up and down. */
static inline size_t scene_grid_cell(const struct scene_grid *g, int x, int y, int z)
{
    return ((size_t)y * (size_t)g->n[0] + (size_t)x) * (size_t)g->n[2] + (size_t)z;
}

/* The nearest front face over (tnear, t_far) of a ray that starts in the centre tile. */
bool scene_grid_trace(const struct scene *s, const struct scene_ray *r, float t_far, struct scene_face *face);
/* Whether there is one. */
bool scene_grid_occluded(const struct scene *s, const struct scene_ray *r, float t_far);
/* Visits each one once. True: the visitor has asked to stop. */
bool scene_grid_visit(const struct scene *s, const struct scene_ray *r, float t_far, struct scene_visitor *v);

#endif
