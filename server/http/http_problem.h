/* The one place that decides HTTP status codes: from status codes of the program, and for what only HTTP can get wrong. */
#ifndef SELVEDGE_SERVER_HTTP_PROBLEM_H
#define SELVEDGE_SERVER_HTTP_PROBLEM_H

#include "base/status.h"

struct http_problem {
    const char *code; /* stable, in the JSON */
    unsigned status;
    const char *title;
};

const struct http_problem *http_problem_of_status(status code);
/* An unknown code is "internal". */
const struct http_problem *http_problem_of_code(const char *code);

#endif
