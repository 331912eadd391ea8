/* Reads the exposures of one view and merges them into one picture in the file's values. */
#ifndef SELVEDGE_OPTIMIZER_VIEW_EXPOSURES_H
#define SELVEDGE_OPTIMIZER_VIEW_EXPOSURES_H

#include "optimizer/photographs/camera/merged_view.h"
#include "optimizer/photographs/camera/photograph_process.h"

static inline bool photograph_process_has_lens(const struct photograph_process *k)
{
    return k->lens.has_vignetting || k->lens.has_distortion;
}
/* Reads all exposures of p, subtracts dark frames, and merges them into image[0], whose record then holds. The files of
 * columns are read once for all columns of a photograph (column_views.h). Errors as photograph_develop states them. */
status view_exposures_read(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                           struct merged_view *e, struct error *err);

#endif
