/* The check of each request's token. A route states the scope that it needs, and by the parameters of its path whether
 * it is about a job ({id}) or about an upload ({upload}); jobs and uploads of other owners are answered as if they did
 * not exist. So a new route is guarded by its row in the table. */
#ifndef SELVEDGE_SERVER_ACCESS_GUARD_H
#define SELVEDGE_SERVER_ACCESS_GUARD_H

#include "server/http/http_request.h"

#define ACCESS_COOKIE "selvedge_session"
/* The secret of a link that shows one job (server/store/store_share.h). */
#define ACCESS_SHARE_COOKIE "selvedge_share"

/* Sets request->grant; returns false after deciding a 401, 403, 404, 429 or 500. */
bool guard_access(struct http_request *request);
/* Whether the token that guard_access has found is still valid; decides a 401 if not. */
bool guard_access_still(struct http_request *request);

#endif
