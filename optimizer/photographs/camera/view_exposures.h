/* The exposures of one view, read and merged into one picture in the file's values. Ownership: the caller gives the
 * structure zeroed and releases it. */
#ifndef SELVEDGE_OPTIMIZER_VIEW_EXPOSURES_H
#define SELVEDGE_OPTIMIZER_VIEW_EXPOSURES_H

#include "optimizer/photographs/camera/exposure_merge.h"
#include "optimizer/photographs/camera/photograph_process.h"

struct view_exposures {
    size_t n;
    const char *name[EXPOSURE_MAX];
    struct image image[EXPOSURE_MAX];
    struct photograph_record record[EXPOSURE_MAX];
    struct image variance;              /* of the merged picture by the camera's noise; no pixels without a record */
    double time_error[EXPOSURE_MAX][3]; /* of the mean rgb of the crop by each cause of errors of the fitted times */
};

static inline bool photograph_process_has_lens(const struct photograph_process *k)
{
    return k->lens.has_vignetting || k->lens.has_distortion;
}
/* Reads all exposures of p, subtracts dark frames, and merges them into image[0], whose record then holds. Errors as
 * photograph_develop states them. */
status view_exposures_read(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                           struct view_exposures *e, struct error *err);
void view_exposures_release(struct view_exposures *e);

#endif
