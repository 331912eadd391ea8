/* A job as a row of a list: what a table shows of it, so that a page of 50 fits in some 15 kB. */
#ifndef SELVEDGE_SERVER_JOB_ROW_VIEW_H
#define SELVEDGE_SERVER_JOB_ROW_VIEW_H

#include "server/jobs/job_service.h"

enum { JOB_DIGEST_BYTES = 13 };

/* The row, without the members that would be null. digest: that of its other members, also its member "digest". The
 * caller owns it; NULL: out of memory. */
json_t *job_row_view(struct job_service *v, const struct job_row *row, char digest[JOB_DIGEST_BYTES]);

#endif
