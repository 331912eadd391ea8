/* Deciding a reply. Every function sets request->reply once; a second call replaces the first. */
#ifndef SELVEDGE_SERVER_HTTP_REPLY_H
#define SELVEDGE_SERVER_HTTP_REPLY_H

#include "server/http/http_server.h"

const char *request_header(const struct http_request *request, const char *name);

void reply_empty(struct http_request *request, unsigned status_code);
void reply_text(struct http_request *request, unsigned status_code, const char *content_type, const char *text,
                size_t n);
/* Takes over body. */
void reply_json(struct http_request *request, unsigned status_code, json_t *body);
/* The same with a strong ETag over the body, and 304 when If-None-Match has it. */
void reply_json_tagged(struct http_request *request, json_t *body);
/* Of the text that reply_json would send: "\"0123...\"". */
void json_tag(const json_t *body, char out[40]);
bool tag_matches(const char *header, const char *tag);

/* code NULL: from err->code. extra (taken over, may be NULL): further members. */
void reply_problem(struct http_request *request, const char *code, const struct error *err, json_t *extra);
void reply_code(struct http_request *request, const char *code, const char *field, const char *detail);
void reply_header(struct http_request *request, const char *name, const char *value);
void reply_header_int(struct http_request *request, const char *name, long long value);

/* Takes over response. */
void reply_response(struct http_request *request, unsigned status_code, struct MHD_Response *response);
/* Takes over fd. Range, If-Range, If-None-Match; a strong tag from inode, size and time. */
void reply_file(struct http_request *request, int fd, const char *content_type);

/* A whole number from the query; absent: fallback; false after deciding a 422. */
bool query_integer(struct http_request *request, const char *name, long long least, long long most, long long fallback,
                   long long *out);

#endif
