#include "server/endpoints/request_json.h"
#include "base/files/json_depth.h"
#include "server/http/http_reply.h"

#include <stdio.h>

/* Returns the first value that is too large or unusual in JSON that is well formed, or NULL: it is not JSON. */
static const char *beyond_limits(const json_error_t *e)
{
    switch (json_error_code(e)) {
    case json_error_numeric_overflow:
        return "a number is too large";
    case json_error_null_character:
    case json_error_null_byte_in_key:
        return "the character NUL is not allowed in a text";
    default:
        return NULL;
    }
}

json_t *request_json(struct http_request *r)
{
    json_error_t e;
    struct error err = {0};
    char text[256];
    if (json_depth_check(r->body, r->n_body, "the body", &err) != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return NULL;
    }
    json_t *j = json_loadb(r->body, r->n_body, JSON_REJECT_DUPLICATES, &e);
    if (j != NULL) return j;
    const char *what = beyond_limits(&e);
    if (what == NULL) {
        snprintf(text, sizeof text, "the body is not JSON: line %d, column %d: %s", e.line, e.column, e.text);
        reply_code(r, "malformed", "", text);
    } else {
        error_set(&err, STATUS_INVALID, "line %d, column %d of the body: %s", e.line, e.column, what);
        reply_problem(r, NULL, &err, NULL);
    }
    return NULL;
}
