/* libmicrohttpd behind one interface. What 0.9.75 does not do is done here: ambiguous framing is refused in the first
 * callback, requests have deadlines and a minimum rate, early answers swallow a body of moderate size so that the client can
 * read them. A reply is decided before or after the body, and queued once. */
#ifndef SELVEDGE_SERVER_HTTP_SERVER_H
#define SELVEDGE_SERVER_HTTP_SERVER_H

#include "server/jobs/job_service.h"

#include <microhttpd.h>

struct http_server;
struct http_route;
struct static_files;

enum { HTTP_PARAM_BYTES = 600, HTTP_MAX_STATUS = 600 };

struct http_request {
    struct http_server *server;
    struct job_service *service;
    struct MHD_Connection *connection;
    const struct http_route *route;
    const char *url;
    char param[2][HTTP_PARAM_BYTES]; /* what {id}, {name}, {path...} stood for */
    int64_t content_length;          /* 0: no body */
    char *body;                      /* JSON bodies: NUL-terminated */
    size_t n_body;
    struct MHD_Response *reply; /* decided; queued when the body is through */
    unsigned reply_status;
    bool queued;
    /* a PATCH on its way to disk */
    struct upload *upload;
    uint64_t ticket;
    status upload_status;
    struct error upload_error;
    struct connection_entry *entry;
};

/* How a request's body is used. */
enum http_body { HTTP_BODY_NONE, HTTP_BODY_JSON, HTTP_BODY_UPLOAD };

struct http_route {
    const char *method, *path; /* path segments in braces are parameters; {path...} takes the rest */
    enum http_body body;
    void (*handle)(struct http_request *request);
    /* before the body (HTTP_BODY_UPLOAD): decides a reply, or prepares request->upload */
    void (*begin)(struct http_request *request);
};

/* The table of all endpoints (http_route.c). */
extern const struct http_route http_route_table[];
extern const size_t http_n_route;
/* NULL and *allow "" : no such path; NULL and *allow "GET, POST": other methods exist. */
const struct http_route *http_route_find(const char *method, const char *url, char param[2][HTTP_PARAM_BYTES],
                                         char *allow, size_t n_allow);

/* listen address and port from the settings; *port is the real one. files: see static_files.h. */
status http_server_start(struct job_service *service, const struct static_files *files, struct http_server **server,
                         unsigned *port, struct error *err);
/* Ends every connection: what uploads had received is kept. */
void http_server_stop(struct http_server *server);
/* Call about once a second: ends connections that are too slow. */
void http_server_reap(struct http_server *server);

const struct static_files *http_server_files(const struct http_server *server);
/* Replies sent with that status so far, and open connections. */
uint64_t http_server_n_reply(const struct http_server *server, unsigned status_code);
size_t http_server_n_connection(const struct http_server *server);

#endif
