#include "geometry/reconstruct/trace_grid.h"

#include <math.h>

/* Bounds of the thickness in which fibers are found in the scan's own grid, and that which thicker and thinner ones
 * have in the rescaled volume. Below FINEST_VOXEL no grid shows single fibers. */
static const double FINEST_VOXEL = 3.0, LEAST_VOXEL = 4.8, MOST_VOXEL = 9.0, THICK_VOXEL = 7.0, THIN_VOXEL = 7.5;
static const double MOST_SLICE_VOXELS = 33.0e6; /* the line filter's limit is 2^25 */

double trace_grid_edge(double diameter_voxel, const size_t n_voxel[3])
{
    if (diameter_voxel > MOST_VOXEL) return diameter_voxel / THICK_VOXEL;
    const double edge = diameter_voxel / THIN_VOXEL;
    if (diameter_voxel < FINEST_VOXEL || diameter_voxel >= LEAST_VOXEL) return 1.0;
    return (double)n_voxel[0] * (double)n_voxel[1] < MOST_SLICE_VOXELS * edge * edge ? edge : 1.0;
}

void trace_grid_rescale_option(struct reconstruct_option *o, double edge)
{
    if (edge == 1.0) return;
    o->s *= edge * edge;
    o->t *= edge * edge;
    o->eps_j /= edge * edge * edge; /* a sum over voxels */
    if (o->h > 0) {
        size_t h = 2 * (size_t)lrint(0.5 * ((double)o->h / edge - 1.0)) + 1;
        o->h = h < 3 ? 3 : h;
    }
}

void trace_grid_rescale_lines(struct polyline_set *lines, double edge)
{
    for (size_t i = 0; i < lines->n_vertex; i++)
        for (int a = 0; a < 3; a++) lines->vertex[i][a] *= (float)edge;
    for (size_t l = 0; l < lines->n_line; l++) lines->radius[l] *= (float)edge;
    polyline_shapes_follow(lines, true);
}
