/* Checks that every request must pass before its handler is called. Each returns false after deciding a reply. */
#ifndef SELVEDGE_SERVER_HTTP_GUARD_H
#define SELVEDGE_SERVER_HTTP_GUARD_H

#include "server/http/http_request.h"

/* Requires a first line without NUL and blanks in its parts, and a Host header where the version needs one. method and
 * version are as the library gives them, in the buffer of the line. */
bool guard_line(struct http_request *request, const char *method, const char *version);
/* Requires an unambiguous body length: no Transfer-Encoding, and no repetition of a header that matters. Sets
 * content_length. */
bool guard_framing(struct http_request *request);
/* Requires that the Host header names this machine (against DNS rebinding) and that a request that changes something
 * does not come from a page of another site. */
bool guard_site(struct http_request *request, const char *method);
/* Requires the body length and content type that the route accepts. */
bool guard_body(struct http_request *request);
/* Requires that the route knows each query parameter, and that none is given twice. */
bool guard_query(struct http_request *request);

#endif
