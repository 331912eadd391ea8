/* Functions that decide the reply to a request. Each sets request->reply; a later call replaces an earlier reply. */
#ifndef SELVEDGE_SERVER_HTTP_REPLY_H
#define SELVEDGE_SERVER_HTTP_REPLY_H

#include "server/http/http_request.h"

/* Returns the value of a request header, or NULL if there is none. */
const char *request_header(const struct http_request *request, const char *name);

void reply_empty(struct http_request *request, unsigned status_code);
void reply_text(struct http_request *request, unsigned status_code, const char *content_type, const char *text,
                size_t n);
/* Takes ownership of body. */
void reply_json(struct http_request *request, unsigned status_code, json_t *body);
/* The same with a strong ETag of the body. Replies 304 if If-None-Match contains that tag. */
void reply_json_tagged(struct http_request *request, json_t *body);
/* Decides a 304 and returns true if If-None-Match contains the tag (with its quotes). */
bool reply_not_modified(struct http_request *request, const char *tag);
/* Returns whether the header, a list of tags or "*", contains the tag. */
bool tag_matches(const char *header, const char *tag);

/* Replies with a problem document. code NULL: the code follows from err->code. extra: further members, owned by the
 * callee (may be NULL). */
void reply_problem(struct http_request *request, const char *code, const struct error *err, json_t *extra);
/* The same from a code of http_problem.c, the name of the field at fault ("" if none) and a sentence. */
void reply_code(struct http_request *request, const char *code, const char *field, const char *detail);
/* Says that no cache may keep the reply that was decided. */
void reply_no_store(struct http_request *request);
void reply_header(struct http_request *request, const char *name, const char *value);
void reply_header_int(struct http_request *request, const char *name, long long value);

/* The rights of a reply that a browser shows as a page. Every reply is sandboxed unless reply_policy says otherwise
 * afterwards: it may hold bytes that a worker or another user wrote, and must not act for its reader. */
enum reply_policy {
    POLICY_SANDBOX,      /* no scripts, no origin, nothing from elsewhere */
    POLICY_SANDBOX_PAGE, /* no scripts; pictures and styles of this origin */
    POLICY_DASHBOARD     /* scripts, styles and pictures of this origin */
};
void reply_policy(struct http_request *request, enum reply_policy policy);

/* Takes ownership of response. */
void reply_response(struct http_request *request, unsigned status_code, struct MHD_Response *response);
/* Replies with a file; takes ownership of fd. Supports Range, If-Range and If-None-Match; the strong ETag comes from
 * inode, size and time of modification. */
void reply_file(struct http_request *request, int fd, const char *content_type);

/* Reads a whole number from the query; `fallback` if it is absent. Returns false after deciding a 422. */
bool query_integer(struct http_request *request, const char *name, long long least, long long most, long long fallback,
                   long long *out);

#endif
