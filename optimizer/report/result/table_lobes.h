/* What results show of a table of measurements in place of pictures: for every lamp a sphere wrapped in the fitted
 * cloth, and for every lobe of the table the rendered radiances over the camera's angle.
 *
 * results/renderings/<first row with that lamp>.{exr,png}: the sphere, seen along the normal of its middle, with the
 * lamp on the left. Each place has the mean radiance of flat cloth that lies there, because the weave is too fine to be
 * seen; in the middle the lamp has the row's azimuth. The cloth of a row that is a mean over all rotations is turned
 * from place to place.
 * results/renderings/lobes.json: [{"row", "camera_theta_deg": [...], "rendered": [[r, g, b], ...], "rendered_se"}];
 * row: the name of the first row of the lobe; angles as in table_camera. */
#ifndef SELVEDGE_OPTIMIZER_TABLE_LOBES_H
#define SELVEDGE_OPTIMIZER_TABLE_LOBES_H

#include "optimizer/report/findings/report.h"

/* Writes both with as many paths as the renderings of so many rows would take, or each estimate's least number. Files
 * that an earlier attempt has written are kept. Progress is reported between the shares `from` and `to` of the stage.
 */
status table_lobes_write(struct report *report, double from, double to, struct error *err);

#endif
