/* The fit's curve for the API: records after a step, merged to at most max_points with minima and maxima kept. */
#ifndef SELVEDGE_SERVER_SERIES_VIEW_H
#define SELVEDGE_SERVER_SERIES_VIEW_H

#include "server/jobs/job_service.h"

/* *view: {"points","models","next_after_step","n_step","generation"}. A job without a series has no points.
 * all_rendered: renderings and paths of rows with every point, not with the last only; then fewer points where they would
 * exceed 8 MiB. */
status series_view(struct job_service *v, const struct job_row *row, long long after_step, size_t max_points,
                   bool all_rendered, json_t **view, struct error *err);

#endif
