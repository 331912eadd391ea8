/* The only place that chooses HTTP status codes, for status codes of the program and for errors that only HTTP has. */
#ifndef SELVEDGE_SERVER_PROBLEM_CODE_H
#define SELVEDGE_SERVER_PROBLEM_CODE_H

#include "base/status.h"

struct http_problem {
    const char *code; /* appears in the JSON; never changes */
    unsigned status;
    const char *title;
};

const struct http_problem *http_problem_of_status(status code);
/* An unknown code gives "internal". */
const struct http_problem *http_problem_of_code(const char *code);

#endif
