/* A request, the row of the table of endpoints that answers it, and the server behind both. */
#ifndef SELVEDGE_SERVER_HTTP_REQUEST_H
#define SELVEDGE_SERVER_HTTP_REQUEST_H

#include "server/access/access_registry.h"
#include "server/jobs/job_service.h"

#include <microhttpd.h>

struct http_server;
struct http_route;
struct static_files;

enum { HTTP_N_PARAM = 3, HTTP_PARAM_BYTES = 600, HTTP_MAX_STATUS = 600 };

struct http_request {
    struct http_server *server;
    struct job_service *service;
    struct MHD_Connection *connection;
    const struct http_route *route;
    const char *url;
    const char *address, *address_end; /* in the first line as it came, and its NUL */
    bool address_spaced;               /* it has blanks or control characters */
    bool begun;                        /* its headers are there */
    int64_t body_memory;               /* bytes of the memory for bodies that it holds */
    struct access_registry *registry;
    struct access_grant grant;                  /* rights of its token */
    char param[HTTP_N_PARAM][HTTP_PARAM_BYTES]; /* values of {id}, {name} and {path...} in the path */
    int64_t content_length;                     /* 0: no body */
    char *body;                                 /* JSON body, NUL-terminated */
    size_t n_body;
    struct MHD_Response *reply; /* decided reply, queued after the whole body has arrived */
    unsigned reply_status;
    bool queued;
    /* the PATCH request that is being written to disk */
    struct upload *upload;
    uint64_t ticket;
    status upload_status;
    struct error upload_error;
    struct connection_entry *entry;
};

/* How a route takes the request's body. HTTP_BODY_BATCH: JSON that may be larger. */
enum http_body { HTTP_BODY_NONE, HTTP_BODY_JSON, HTTP_BODY_BATCH, HTTP_BODY_UPLOAD };

struct http_route {
    const char *method, *path; /* path segments in braces are parameters; {path...} matches the rest of the path */
    enum access_scope need;    /* of a token, once there are tokens (access_guard.h) */
    const char *query;         /* names of the query parameters that it takes, between spaces; NULL: any */
    enum http_body body;
    void (*handle)(struct http_request *request);
    /* called before the body (HTTP_BODY_UPLOAD): decides a reply or sets request->upload */
    void (*begin)(struct http_request *request);
    /* called in place of `handle` when the connection ends while request->upload is set */
    void (*abandon)(struct http_request *request);
};

/* Finds the route of a request and the values of its path's parameters. NULL and *allow "": there is no such path;
 * NULL and *allow "GET, POST": the path has only these methods. */
typedef const struct http_route *http_route_finder(const char *method, const char *url,
                                                   char param[HTTP_N_PARAM][HTTP_PARAM_BYTES], char *allow,
                                                   size_t n_allow);

#endif
