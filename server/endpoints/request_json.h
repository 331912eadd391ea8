/* The JSON body of a request. */
#ifndef SELVEDGE_SERVER_REQUEST_JSON_H
#define SELVEDGE_SERVER_REQUEST_JSON_H

#include "server/endpoints/handlers.h"

#include <jansson.h>

/* Returns the body as JSON (a new reference), or NULL after a reply: 400 when it is not JSON, and 422 when it is JSON
 * that cannot be represented: with a number above 9223372036854775807, with the character NUL in a text, or with more
 * than JSON_DEPTH_MOST levels. */
json_t *request_json(struct http_request *r);

#endif
