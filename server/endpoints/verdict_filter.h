/* The query parameter "verdict" of lists of jobs: codes of verdicts (base/catalogue/verdict_code.h) between commas. */
#ifndef SELVEDGE_SERVER_VERDICT_FILTER_H
#define SELVEDGE_SERVER_VERDICT_FILTER_H

#include "server/http/http_request.h"

enum { VERDICT_FILTER_BYTES = 256 };

/* Writes the codes as ",good,pictures_only," (job_query.verdict); "none", of jobs without a verdict, is the empty code.
 * "" without the parameter. Returns false after deciding a reply that refuses another word. */
bool verdict_filter_read(struct http_request *request, char filter[VERDICT_FILTER_BYTES]);

#endif
