/* The radiances that the numbers of a surface model are fitted to: the job's rows as the job renders them, and
 * the fitted cloth over lamps and cameras of the hemisphere (cloth_directions.h), which weigh half as much
 * as all rows. Some nine rows alone would fix a dozen numbers, and leave them free everywhere else. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_TARGET_H
#define SELVEDGE_OPTIMIZER_TEXTURE_TARGET_H

#include "optimizer/report/export/export_scene.h"

enum texture_part { TEXTURE_FITTED_ROW, TEXTURE_HELDOUT_ROW, TEXTURE_FITTED_DIRECTION, TEXTURE_OTHER_DIRECTION };

struct texture_radiance {
    struct configuration configuration;
    enum texture_part part;
    double rgb[3];
    double scale;  /* 1 over the mean of its channels, or over OBJECTIVE_TAU where that is more (objective.h) */
    double weight; /* of its squared error in the fit; 0 where it is not fitted */
};

struct texture_target {
    size_t n, n_row; /* n_row: the first ones are the rows of the job, in their order */
    struct texture_radiance *item;
};

/* Traces the hemisphere. from, to: shares of e->progress. Errors of estimate_run, STATUS_NO_MEMORY. Release in any
 * case. */
status texture_target_make(const struct export_scene *e, double from, double to, struct texture_target *t,
                           struct error *err);
void texture_target_release(struct texture_target *t);
/* Paths of a photograph that take as long. */
double texture_target_paths(void);

#endif
