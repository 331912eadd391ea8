/* Crop and camera of a photograph from square markers around the sample (rig.h, "markers"). The markers lie in the
 * plane of the cloth and turn with it. */
#ifndef SELVEDGE_OPTIMIZER_MARKER_VIEWS_H
#define SELVEDGE_OPTIMIZER_MARKER_VIEWS_H

#include "optimizer/photographs/camera/lens.h"
#include "optimizer/photographs/camera/marker_board.h"

struct job_photograph;
struct job_rows;
struct job_setup;

/* Where the camera of a picture was, and where the orbit center is in it. */
struct marker_view {
    size_t n_marker, n_corner; /* of the board's markers, of the chessboard's corners */
    double rms_px;             /* residual between markers and map */
    double center_px[2];       /* of the orbit, in the picture without distortion */
    double px_per_mm;          /* at the orbit center, perpendicular to the view */
    bool has_camera;           /* the lens' focal lengths are known */
    double camera_mm[3];       /* in the frame of the cloth */
    double map[9];             /* from the markers' plane to the picture without distortion (plane_pose.h) */
};

/* Finds the board in a picture. The corners of a chessboard are looked for where the found markers promise them,
 * and count only between two markers that were found, so that cloth on the board does no harm; eight of them
 * replace the corners of the markers. STATUS_INVALID: fewer than two of its markers, or places that contradict the
 * picture by more than a tenth of a marker. */
status marker_view_find(const struct marker_board *board, const struct lens *lens, const struct image *im,
                        struct marker_view *view, struct error *err);
/* Fills in two values that photograph p leaves out: the crop of crop_cm about the orbit center (of a cylinder along its
 * axis, with all of the picture across), and the place of the camera. */
status marker_view_apply(const struct marker_view *view, double crop_cm, size_t width, size_t height,
                         struct job_photograph *p, struct error *err);
/* Does both for every photograph of the document that leaves out its crop or its camera, and gives cylinders without
 * edges the outline by the markers (cylinder_place.h); files are in `folder`. Without
 * a board (n 0) a photograph whose camera is not given is an error. err->field is an option id. */
status marker_views_apply(const struct marker_board *board, const struct lens *lens, const char *folder,
                          struct job_setup *setup, struct job_rows *rows, struct error *err);

#endif
