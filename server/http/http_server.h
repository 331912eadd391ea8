/* The HTTP server, built on libmicrohttpd, with a thread for each connection: one that waits for the disk or computes
 * an answer keeps no other waiting. It adds to version 0.9.75: requests with ambiguous framing are refused in the first
 * callback, requests have deadlines and a minimum rate, and after an early reply a body of moderate size is read to its
 * end so that the client can receive the reply. A reply may be decided before or after the body; it is queued once. */
#ifndef SELVEDGE_SERVER_HTTP_SERVER_H
#define SELVEDGE_SERVER_HTTP_SERVER_H

#include "server/http/http_listen.h"
#include "server/http/http_request.h"

/* Listens as the settings say (http_listen.h) and answers requests, each by the route that find_route gives for it.
 * *url is the address. files: see static_files.h. Fails as http_listen does, and with STATUS_NO_MEMORY. */
status http_server_start(struct job_service *service, http_route_finder *find_route, const struct static_files *files,
                         struct http_server **server, char url[LISTEN_URL_BYTES], struct error *err);
/* Ends all connections and frees the server. Bytes that unfinished uploads have received stay on disk. */
void http_server_stop(struct http_server *server);
/* Ends connections that are too slow. To be called about once a second. */
void http_server_reap(struct http_server *server);

const struct static_files *http_server_files(const struct http_server *server);
/* The number of replies with the given status code so far, and of open connections. */
uint64_t http_server_n_reply(const struct http_server *server, unsigned status_code);
size_t http_server_n_connection(const struct http_server *server);

#endif
