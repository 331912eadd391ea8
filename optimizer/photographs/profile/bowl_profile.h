/* From photographs of a bowl to the profile of the fiber above it.
 *
 * Each photograph is developed like photographs of cloth (dark frames, exposures merged by the camera's noise, lens),
 * its background is subtracted, and then the light that the bowl throws onto itself. In a part of a sphere of height h,
 * of radius R and matte reflectance rho, every place gets the same irradiance from every other one, so reflection adds
 * the same light everywhere: rho h / (2 R) times the mean over the bowl of all irradiance, as photographed. (The thesis
 * fits this constant, I_a of equation 4.6, to a direct measurement.) The remaining light is a sample of the profile in
 * each pixel (bowl_place.h), and the samples become cells (bowl_cells.h). Radiances have no absolute scale: the fit has
 * one.
 *
 * The azimuth of the light about the fiber is known too: the lamp's, less the turn of the fiber in its holder.
 *
 * Masked and saturated places count with the mean of all other places. */
#ifndef SELVEDGE_OPTIMIZER_BOWL_PROFILE_H
#define SELVEDGE_OPTIMIZER_BOWL_PROFILE_H

#include "optimizer/job/document/job_limits.h"
#include "optimizer/photographs/profile/bowl_camera.h"
#include "optimizer/photographs/profile/fiber_profile.h"

struct job_bowl;
struct job_rows;
struct job_setup;

/* The record of one photograph. */
struct bowl_shot {
    size_t n_pixel, n_saturated, n_cell; /* pixels of the bowl; saturated ones of them; rows of the profile */
    double mean, background, reflected;  /* mean over the bowl of the green channel; the background's part of the mean;
                                          * reflections */
};

struct bowl_record {
    struct bowl_camera camera;
    size_t n_shot;
    struct bowl_shot shot[JOB_MAX_BOWL_PHOTOGRAPH];
};

/* Makes the profile of the photographs in `folder` that the document names. record may be NULL. Errors: from
 * photograph_develop and bowl_camera_fit; STATUS_INVALID with the field of the photograph at fault for sizes that
 * differ, more than 2 % of the bowl saturated, a background as bright as the photograph, a picture that shows no bowl,
 * and cells without enough pixels; STATUS_TOO_LARGE for more than PROFILE_MAX_ROW cells. */
status bowl_profile_load(struct fiber_profile *profile, const struct job_bowl *bowl, struct job_setup *setup,
                         struct job_rows *rows, const char *folder, struct bowl_record *record, struct error *err);
/* A picture (width x height of the photograph) of photograph 0 with lines of theta_o and azimuth every 15 degrees, and
 * with pixels that do not count in red. The caller releases it. */
status bowl_profile_picture(const struct job_bowl *bowl, struct job_setup *setup, struct job_rows *rows,
                            const char *folder, struct image *picture, struct error *err);

#endif
