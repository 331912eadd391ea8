/* The exposures of one view, merged into one picture in the file's values (view_exposures.h). Ownership: the caller
 * gives the structure zeroed and releases it. */
#ifndef SELVEDGE_OPTIMIZER_MERGED_VIEW_H
#define SELVEDGE_OPTIMIZER_MERGED_VIEW_H

#include "optimizer/photographs/camera/exposure_merge.h"
#include "optimizer/photographs/reader/photograph.h"

struct merged_view {
    size_t n;
    const char *name[EXPOSURE_MAX];
    struct image image[EXPOSURE_MAX];
    struct photograph_record record[EXPOSURE_MAX];
    struct image variance;              /* of the merged picture by the camera's noise; no pixels without a record */
    double time_error[EXPOSURE_MAX][3]; /* of the mean rgb of the crop by each cause of errors of the fitted times */
    double light_mean[3];               /* that mean, of a merged picture; of a column: over all columns */
};

void merged_view_release(struct merged_view *e);

#endif
