/* Lamp, camera and outline of a cylinder by the job document and by markers. */
#ifndef SELVEDGE_OPTIMIZER_CYLINDER_PLACE_H
#define SELVEDGE_OPTIMIZER_CYLINDER_PLACE_H

#include "optimizer/photographs/camera/lens.h"
#include "optimizer/photographs/cylinder/cylinder_view.h"

struct job_photograph;
struct job_setup;

/* The view of a photograph of a cylinder. STATUS_INVALID as cylinder_view_init. */
status cylinder_place_view(const struct job_setup *setup, const struct job_photograph *p, struct cylinder_view *v,
                           struct error *err);
/* Projects the outline into p->cylinder.markers_px by the map from the markers' plane, the plane of the highest line,
 * to the picture without distortion (plane_pose.h). STATUS_INVALID as the function above and plane_map_project. */
status cylinder_place_by_markers(const struct job_setup *setup, const double map[9], const struct lens *lens,
                                 struct job_photograph *p, struct error *err);

#endif
