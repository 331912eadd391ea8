/* The curve of the fit for the API: records after a step, merged to at most max_points with minima and maxima kept. */
#ifndef SELVEDGE_SERVER_SERIES_VIEW_H
#define SELVEDGE_SERVER_SERIES_VIEW_H

#include "server/jobs/job_service.h"

/* *view: {"points","models","next_after_step","n_step","generation"}. A job without a series has no points.
 * all_rendered: every point, not only the last, has renderings and paths of rows; there are then fewer points if
 * they would exceed 8 MiB. STATUS_IO, STATUS_NO_MEMORY. */
status series_view(struct job_service *v, const struct job_row *row, long long after_step, size_t max_points,
                   bool all_rendered, json_t **view, struct error *err);

#endif
