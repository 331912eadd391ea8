/* The photograph of a cylinder as it was read and merged, kept for its other columns: its files are read once, not once
 * for each column. Holds one photograph; a column of another one takes its place. Ownership: release. Not
 * thread-safe. */
#ifndef SELVEDGE_OPTIMIZER_COLUMN_VIEWS_H
#define SELVEDGE_OPTIMIZER_COLUMN_VIEWS_H

#include "optimizer/photographs/camera/merged_view.h"

struct column_views {
    bool full;
    size_t index, view_px[4]; /* of the photograph that is kept (job_photograph.h) */
    struct merged_view view;
};

void column_views_release(struct column_views *v);
/* Returns whether the photograph of the column p is kept. */
bool column_views_has(const struct column_views *v, const struct job_photograph *p);
/* Moves e, read for the column p with the crop p->column.view_px, into v. */
void column_views_keep(struct column_views *v, const struct job_photograph *p, struct merged_view *e);
/* Copies what is kept for the column p into e, which is zeroed: of the picture, the merged one alone, as a whole, or
 * with `cut`, which is for pictures that were cropped when they were read, the crop of p. STATUS_NO_MEMORY. */
status column_views_copy(const struct column_views *v, const struct job_photograph *p, bool cut, struct merged_view *e,
                         struct error *err);

#endif
