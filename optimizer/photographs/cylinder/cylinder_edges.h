/* The outline of a cylinder in a picture: two silhouettes, straight lines that run nearly along the axis.
 *
 * Frame of the functions: u across the cylinder, from the side of -x to the side of +x, and v along it, against the
 * direction of the axis, both in pixels of the picture; a turn by the word of the job document leads there
 * (`up`: u = x, v = y). Places count from the upper left corner of the picture, centers of pixels are at halves. */
#ifndef SELVEDGE_OPTIMIZER_CYLINDER_EDGES_H
#define SELVEDGE_OPTIMIZER_CYLINDER_EDGES_H

#include "base/status.h"
#include "optimizer/job/document/job_photograph.h"
#include "renderer/image/image.h"

struct cylinder_edges {
    double line[2][2];    /* of each silhouette, left first: u = line[0] + line[1] v */
    double se_px;         /* standard error of a silhouette's place */
    bool dark_background; /* found before a background that is black beside the cloth */
};

void cylinder_edges_to_frame(enum job_axis axis, const double xy[2], double uv[2]);
void cylinder_edges_to_picture(enum job_axis axis, const double uv[2], double xy[2]);
/* The outline through two points on each silhouette, in either order. STATUS_INVALID: two points at one height, lines
 * that cross or lie more than 45 degrees from the axis' direction. */
status cylinder_edges_of_points(enum job_axis axis, const double px[8], struct cylinder_edges *e, struct error *err);
/* Finds the outline in a picture that shows the cylinder before an even background, which must be seen on both sides.
 * origin_px: place of the picture's upper left corner, which is added. In bands across the axis the first departure
 * from the background on each side is taken at its steepest place; lines are fitted to at least 60 % of the bands.
 * STATUS_NOT_FOUND with the reason; dark_background is set all the same. */
status cylinder_edges_find(const struct image *im, const double origin_px[2], enum job_axis axis,
                           struct cylinder_edges *e, struct error *err);
/* Pixels between the silhouettes at the height v, perpendicular to them. */
double cylinder_edges_width_px(const struct cylinder_edges *e, double v);
/* Corners of the part from s0 to s1 across (cylinder_view.h) and v0 to v1 along: upper left, upper right, lower right,
 * lower left with the axis upwards, as places of the picture. */
void cylinder_edges_part(const struct cylinder_edges *e, enum job_axis axis, const double v[2], const double s[2],
                         double corner_px[4][2]);

#endif
