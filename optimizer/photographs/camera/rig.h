/* The rig file: the lamps, cameras, views and lens of a measuring apparatus, described once. JSON, strictly read:
 *
 *   {"selvedge_rig": 1,
 *    "lamps":   {"lamp-20": {"theta_deg": 20, "phi_deg": 0}, "side": {"position_mm": [430, 0, 430]}},
 *    "cameras": {"top": {"theta_deg": 0, "phi_deg": 0, "distance_cm": 90}},
 *    "views":   {"v01": {"lamp": "lamp-20", "camera": "top", "cloth_rotation_deg": 90}},
 *    "lens":    {"vignetting": {"center_px": [x, y], "radius_px": R, "a": [a1, a2, a3]},
 *                "distortion": {"focal_px": [fx, fy], "center_px": [cx, cy], "k": [k1, k2, k3], "p": [p1, p2]}}}
 *
 * A place is given by angles (and distance_cm, by default the document's), or by a position in millimetres from the
 * orbit center: x along the weft, y along the warp, z up. `lens` may be left out, and so may
 *
 *    "markers": {"dictionary": "4x4_50", "side_mm": 10, "center_mm": {"0": [-30, 30], "1": [30, 30]}}
 *
 * or, for a ChArUco board,
 *
 *    "markers": {"dictionary": "4x4_50", "side_mm": 8, "charuco": {"squares": [9, 7], "square_mm": 11,
 *                "upper_left_mm": [-49.5, 38.5], "first_square": "black"}}
 *
 * (marker_board.h). With markers a view may leave out its camera, whose place then follows from them. */
#ifndef SELVEDGE_OPTIMIZER_RIG_H
#define SELVEDGE_OPTIMIZER_RIG_H

#include "optimizer/photographs/camera/lens.h"
#include "optimizer/photographs/camera/marker_board.h"

struct job_rows;
struct job_setup;

/* Reads the rig and gives every photograph of the document that names a view the angles and distances of the view.
 * STATUS_INVALID / STATUS_FORMAT with a text that names file and key; err->field is an option id where a photograph is
 * at fault (an unknown view, a lamp behind the cloth with a black sheet). */
status rig_apply(const char *path, struct job_setup *setup, struct job_rows *rows, struct lens *lens,
                 struct marker_board *board, struct error *err);

#endif
