/* From the files of one view to an image in radiance units, by the job's knowledge of its camera: dark frames, the
 * record of its noise, several exposures, a color chart or a white reference.
 *
 * Steps: each exposure is read and cropped; the mean of the dark frames of its exposure time is subtracted; exposures
 * are timed by their light (exposure_ratio.h) and merged (exposure_merge.h); the errors of the lens are removed
 * (lens.h); the values are divided by the exposure (photograph.h), multiplied by the color matrix, by the scale, and by
 * the square of the lamp's distance over the document's distance. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_DEVELOP_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_DEVELOP_H

#include "optimizer/photographs/camera/photograph_process.h"

/* Develops a photograph of the job. record may be NULL. Errors as in photograph_read; STATUS_INVALID besides: the
 * errors of exposure_ratio_fit; exposures of different sizes, ISO values or f-numbers, or of unknown time; no dark
 * frame of the exposure time; a noise record of another ISO value. */
status photograph_develop(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                          struct image *im, struct photograph_record *record, struct error *err);

#endif
