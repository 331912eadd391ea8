/* Meshes of cloth that is bent along one direction only: a curve in a plane, along which the weft (u) runs, moved along
 * a straight line, the warp (v). Lengths of the cloth are kept. The origin is the middle of the bounding box, z is up.
 */
#ifndef SELVEDGE_RENDERER_MESH_CURVES_H
#define SELVEDGE_RENDERER_MESH_CURVES_H

#include "renderer/mesh/mesh.h"

/* A roll that lies along y: the upper side of the cloth is outside, on the outermost turn of radius_mm; each turn lies
 * pitch_mm inside of the one before, the innermost at about core_mm, and a tail of tail_mm lies flat beside the roll,
 * towards +x, with the lower side up. STATUS_INVALID: lengths that are not positive, a core that is not smaller than
 * the roll, more than 200 turns; STATUS_NO_MEMORY. */
struct mesh_roll {
    double radius_mm, core_mm, pitch_mm, tail_mm, length_mm;
};
status mesh_roll_make(const struct mesh_roll *roll, struct mesh *m, struct error *err);

/* A hung piece, width_mm of cloth along the weft and height_mm upright, in n_fold folds that turn by up to angle_rad
 * from the plane x-z, each of a slightly different depth; the upper side is towards -y. STATUS_INVALID: lengths that
 * are not positive, no folds or more than 50, an angle of 1.5 rad and more; STATUS_NO_MEMORY. */
struct mesh_folds {
    double width_mm, height_mm, angle_rad;
    size_t n_fold;
};
status mesh_folds_make(const struct mesh_folds *folds, struct mesh *m, struct error *err);

#endif
