/* The HTTP server, built on libmicrohttpd, with a thread for each connection: one that waits for the disk or computes
 * an answer keeps no other waiting. It adds what version 0.9.75 lacks: requests with ambiguous framing are refused in
 * the first callback, requests have deadlines and a minimum rate, and after an early reply a body of moderate size is
 * read to its end so that the client can receive the reply. A reply may be decided before or after the body; it is
 * queued once. */
#ifndef SELVEDGE_SERVER_HTTP_SERVER_H
#define SELVEDGE_SERVER_HTTP_SERVER_H

#include "server/access/access_registry.h"
#include "server/http/http_listen.h"
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
    struct access_desk *desk;
    struct access_grant grant;                  /* what its token allows */
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

/* What a route does with the request's body. HTTP_BODY_BATCH: JSON that may be larger. */
enum http_body { HTTP_BODY_NONE, HTTP_BODY_JSON, HTTP_BODY_BATCH, HTTP_BODY_UPLOAD };

struct http_route {
    const char *method, *path; /* path segments in braces are parameters; {path...} matches the rest of the path */
    enum http_body body;
    enum access_scope need; /* of a token, once there are tokens (access_guard.h) */
    void (*handle)(struct http_request *request);
    /* called before the body (HTTP_BODY_UPLOAD): decides a reply or sets request->upload */
    void (*begin)(struct http_request *request);
    const char *query; /* names of the query parameters that it takes, between spaces; NULL: any */
};

/* Finds the route of a request and the values of its path's parameters. NULL and *allow "": there is no such path;
 * NULL and *allow "GET, POST": the path has only these methods. */
typedef const struct http_route *http_route_finder(const char *method, const char *url,
                                                   char param[HTTP_N_PARAM][HTTP_PARAM_BYTES], char *allow,
                                                   size_t n_allow);
/* That of the service's endpoints, by the table in http_route.c. */
http_route_finder http_route_find;

/* Listens as the settings say (http_listen.h) and answers requests, each by the route that find_route gives for it.
 * *url is the address. files: see static_files.h. Fails as http_listen does, and with STATUS_NO_MEMORY. */
status http_server_start(struct job_service *service, http_route_finder *find_route, const struct static_files *files,
                         struct http_server **server, char url[LISTEN_URL_BYTES], struct error *err);
/* Ends all connections and frees the server. What unfinished uploads have received is kept. */
void http_server_stop(struct http_server *server);
/* Ends connections that are too slow. To be called about once a second. */
void http_server_reap(struct http_server *server);

const struct static_files *http_server_files(const struct http_server *server);
/* The number of replies with the given status code so far, and of open connections. */
uint64_t http_server_n_reply(const struct http_server *server, unsigned status_code);
size_t http_server_n_connection(const struct http_server *server);

#endif
