/* A job as a row of a list. It has only the members of a table's row, so that a page of 50 fits in some 15 kB. */
#ifndef SELVEDGE_SERVER_JOB_ROW_VIEW_H
#define SELVEDGE_SERVER_JOB_ROW_VIEW_H

#include "server/jobs/job_service.h"

enum { JOB_DIGEST_BYTES = 13 };

/* Returns the row without null members, owned by the caller, or NULL when memory is out. digest: receives the value of
 * the member "digest", a hash of all other members. */
json_t *job_row_view(struct job_service *v, const struct job_row *row, char digest[JOB_DIGEST_BYTES]);

#endif
