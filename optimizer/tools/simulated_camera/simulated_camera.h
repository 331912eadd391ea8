/* Raw files of a simulated camera: what a laboratory would have of a cloth whose photographs have been rendered
 * (phantom_photographs.h). The camera has a Bayer sensor with noise, dark current, black level and a gain, colors of
 * its own, a wrong white balance, a lens with vignetting and distortion, and looks a little past the sample; each view
 * is taken with several exposure times. Besides the views it takes a ColorChecker, seen obliquely, and dark and flat
 * frames. */
#ifndef SELVEDGE_OPTIMIZER_SIMULATED_CAMERA_H
#define SELVEDGE_OPTIMIZER_SIMULATED_CAMERA_H

#include "base/thread_pool.h"
#include "optimizer/photographs/camera/lens.h"
#include "optimizer/tools/simulated_camera/sensor.h"

enum { SIMULATED_EXPOSURES = 3, SIMULATED_DARK = 8, SIMULATED_FLAT = 6 };

struct simulated_camera_option {
    const char *source;                     /* folder with photographs.json, truth.json and the renderings */
    const char *folder;                     /* created when it does not exist */
    size_t size_px[2];                      /* of the picture in cells of 2 x 2 photosites */
    double px_per_mm;                       /* such cells, at the orbit center */
    double crop_cm;                         /* of the job; the renderings show more */
    double exposure_s[SIMULATED_EXPOSURES]; /* from the shortest on */
    double chart_exposure_s, chart_light_theta_deg, chart_camera_theta_deg, chart_camera_phi_deg;
    double aim_mm;             /* largest distance by which the camera looks past the orbit center */
    bool cameras_from_markers; /* the rig does not say where the camera was */
    uint64_t seed;
    struct sensor sensor;
};

void simulated_camera_option_default(struct simulated_camera_option *o);

/* Writes FOLDER/NAME-0.dng .. NAME-2.dng for each rendering NAME.exr, chart.dng, dark-0.dng .., flat-0.dng ..,
 * rig.json, camera-job.json (the keys of a job document that concern photographs; camera.noise_file is noise.json,
 * which `selvedge calibrate-camera` makes of dark and flat frames) and truth.json: that of the source, whose mean_rgb
 * are now those of the job's crop. STATUS_INVALID for renderings that do not show more than the crop, or for different
 * cameras. */
status simulated_camera_make(const struct simulated_camera_option *o, struct thread_pool *pool, struct error *err);

#endif
