/* What every request must pass before its endpoint sees it. Each returns false after deciding a reply. */
#ifndef SELVEDGE_SERVER_HTTP_GUARD_H
#define SELVEDGE_SERVER_HTTP_GUARD_H

#include "server/http/http_server.h"

/* One clear length: no Transfer-Encoding, no repeated headers of meaning. Sets content_length. */
bool guard_framing(struct http_request *request);
/* Host names this machine (DNS rebinding), and a change does not come from another site's page. */
bool guard_site(struct http_request *request, const char *method);
/* Length and content type that the route wants. */
bool guard_body(struct http_request *request);

#endif
