/* HTTP for the command line client, on libcurl: JSON calls, pieces of uploads, and downloads that can continue. One
 * connection handle, for use by one thread. */
#ifndef SELVEDGE_CLIENTS_CLI_HTTP_H
#define SELVEDGE_CLIENTS_CLI_HTTP_H

#include "base/status.h"

#include <jansson.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

struct http;

/* server: "http://host:port", with or without a trailing '/', or "unix:/path/of/the.socket". token may be NULL. stop is
 * set by a signal handler (may be NULL); a transfer then soon ends with STATUS_CANCELLED. STATUS_NO_MEMORY. */
status http_new(const char *server, const char *token, const volatile sig_atomic_t *stop, struct http **http,
                struct error *err);
void http_free(struct http *http);
const char *http_server(const struct http *http);
bool http_stopped(const struct http *http);
/* Sleeps; returns early if stopped. */
void http_sleep(const struct http *http, double seconds);

struct http_reply {
    long code;             /* HTTP status */
    char *body;            /* NUL-terminated, at most 64 MiB */
    size_t n_body, n_room; /* bytes of body, and bytes allocated for it */
    char etag[160], location[512];
    int64_t upload_offset; /* from tus; -1 if absent */
    int64_t log_next;      /* from the header Selvedge-Next-Offset; -1 if absent */
    double retry_after_s;  /* -1 if absent */
    bool cut_off;          /* the connection broke or timed out, so another try may succeed */
    bool refused;          /* there was no connection, so the server does not run */
};
void http_reply_release(struct http_reply *reply);

/* Sends one request. body may be NULL; header is a NULL-terminated list of "Name: value" lines, or NULL. STATUS_OK
 * means that a reply came, whatever its HTTP status. STATUS_IO: the server was not reachable or the connection broke
 * (reply->cut_off); the text states the remedy. */
status http_call(struct http *http, const char *method, const char *path, const char *const *header, const void *body,
                 size_t n_body, struct http_reply *reply, struct error *err);
/* Sends a PATCH whose body is the next n_bytes of a file descriptor. `sent` is called with the bytes of each piece
 * that was sent. */
struct http_source {
    int fd;
    uint64_t n_bytes;
    void (*sent)(void *context, uint64_t n_bytes);
    void *context;
};
status http_patch(struct http *http, const char *path, const char *const *header, struct http_source *source,
                  struct http_reply *reply, struct error *err);

/* A call that must succeed with 2xx and JSON (*out NULL if the reply has no body). Otherwise err comes from the
 * problem document: its detail is the text, its field the field, and the code follows from the HTTP status. key:
 * Idempotency-Key or NULL; out may be NULL. 503 and 429 with Retry-After are tried again, and so are broken
 * connections if repeating is harmless (for all calls except creating a job without a key). */
status http_json(struct http *http, const char *method, const char *path, const char *key, const json_t *body,
                 json_t **out, struct error *err);
/* Sets err from a reply that is not 2xx. */
status http_problem(const struct http_reply *reply, struct error *err);

/* Downloads to path + ".part" and renames it at the end. Continues an earlier ".part" by a range request if the ETag
 * (kept in path + ".part.etag") is the same. Broken connections are tried again. `got` is called with the bytes so
 * far and in total (0: unknown). */
status http_download(struct http *http, const char *url_path, const char *path,
                     void (*got)(void *context, uint64_t n, uint64_t n_total), void *context, struct error *err);

#endif
