/* Raw files of a simulated camera: the files that a laboratory would have for a cloth whose photographs have been
 * rendered (phantom_photographs.h). The camera has a Bayer sensor with noise, dark current, black level and a gain,
 * colors of its own, a wrong white balance, a lens with vignetting and distortion, and looks a little past the sample;
 * each view is taken with several exposure times. Besides the views it takes a ColorChecker, seen obliquely, and dark
 * and flat frames. */
#ifndef SELVEDGE_OPTIMIZER_SIMULATED_CAMERA_H
#define SELVEDGE_OPTIMIZER_SIMULATED_CAMERA_H

#include "base/thread_pool.h"
#include "optimizer/tools/simulated_camera/simulated_option.h"

void simulated_camera_option_default(struct simulated_camera_option *o);

/* Writes FOLDER/NAME-0.dng .. NAME-2.dng for each rendering NAME.exr, chart.dng, dark-0.dng .., flat-0.dng ..,
 * rig.json, camera-job.json (the keys of a job document that concern photographs; camera.noise_file is noise.json,
 * which `selvedge calibrate-camera` makes of dark and flat frames) and truth.json: a copy of the source's file, whose
 * mean_rgb are now means over the job's crop. STATUS_INVALID for renderings that do not show more than the crop, or for
 * different cameras. */
status simulated_camera_make(const struct simulated_camera_option *o, struct thread_pool *pool, struct error *err);

#endif
