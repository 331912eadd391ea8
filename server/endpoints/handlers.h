/* The handlers of the endpoints (endpoints.def). Each decides exactly one reply. */
#ifndef SELVEDGE_SERVER_HANDLERS_H
#define SELVEDGE_SERVER_HANDLERS_H

#include "server/http/http_request.h"

#define ENDPOINT(method, path, name, ...) void handle_##name(struct http_request *request);
#include "server/endpoints/endpoints.def"
#undef ENDPOINT
/* Before the body of an upload: decides a reply or sets request->upload. */
void handle_upload_bytes_begin(struct http_request *request);
/* The connection broke during a PATCH: commits the bytes that have arrived. */
void handle_upload_bytes_abandoned(struct http_request *request);
/* The files of the dashboard. */
void handle_static(struct http_request *request);

/* Replies 201 with a job that was made, now or by an earlier request (`replayed`). */
void reply_new_job(struct http_request *request, const char *id, bool replayed);
/* Judges the files of a job that is to be started. Returns false after deciding a reply: 422 with all faults, or why
 * they could not be judged. */
bool check_inputs(struct http_request *request);
/* Sends an open file of a job, which is sandboxed whatever its type. Pages may show pictures and styles beside them. */
void reply_foreign_file(struct http_request *request, int fd, const char *name);

#endif
