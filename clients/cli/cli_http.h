/* HTTP for the CLI, on libcurl: JSON calls, chunks of uploads, downloads that continue. One handle, one thread. */
#ifndef SELVEDGE_CLIENTS_CLI_HTTP_H
#define SELVEDGE_CLIENTS_CLI_HTTP_H

#include "base/status.h"

#include <jansson.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

struct http;

/* server: "http://host:port", a trailing '/' is allowed. token may be NULL. stop: set by a signal handler, NULL allowed; every transfer
 * ends with STATUS_CANCELLED soon after. STATUS_NO_MEMORY. */
status http_new(const char *server, const char *token, const volatile sig_atomic_t *stop, struct http **http,
                struct error *err);
void http_free(struct http *http);
const char *http_server(const struct http *http);
bool http_stopped(const struct http *http);
/* Sleeps; returns early when stopped. */
void http_sleep(const struct http *http, double seconds);

struct http_reply {
    long code;  /* HTTP status */
    char *body; /* NUL-terminated, at most 64 MiB */
    size_t n_body;
    char etag[160], location[512];
    int64_t upload_offset; /* tus; -1 when absent */
    int64_t log_next;      /* value of the header Selvedge-Next-Offset; -1 when absent */
    double retry_after_s;  /* -1 when absent */
    bool cut_off;          /* the connection broke or timed out: worth another try */
    bool refused;          /* there was no connection at all: the server is not running */
};
void http_reply_release(struct http_reply *reply);

/* One request. body may be NULL; header: NULL-terminated list of "Name: value" lines, NULL allowed. STATUS_OK means that an answer came,
 * whatever its status. STATUS_IO: not reachable or cut off (reply->cut_off); the text says what to do. */
status http_call(struct http *http, const char *method, const char *path, const char *const *header, const void *body,
                 size_t n_body, struct http_reply *reply, struct error *err);
/* A PATCH whose body is n_bytes of the file descriptor from its current position. sent is called with the bytes of this call. */
struct http_source {
    int fd;
    uint64_t n_bytes;
    void (*sent)(void *context, uint64_t n_bytes);
    void *context;
};
status http_patch(struct http *http, const char *path, const char *const *header, struct http_source *source,
                  struct http_reply *reply, struct error *err);

/* A call that must succeed: 2xx and JSON (NULL when the answer has no body). Otherwise err from the problem document: text is its detail,
 * field the field at fault, code from the HTTP status. key: Idempotency-Key or NULL; out may be NULL. 503 and 429 with Retry-After, and
 * connections cut off where repeating is harmless (all but making a job without a key), are tried again. */
status http_json(struct http *http, const char *method, const char *path, const char *key, const json_t *body,
                 json_t **out, struct error *err);
/* Turn an answer that is not 2xx into err. */
status http_problem(const struct http_reply *reply, struct error *err);

/* Download into path + ".part", continued by a range request when that is there with the same ETag (kept in path + ".part.etag"), then renamed.
 * Broken connections are tried again. got is called with bytes so far and in all (0: unknown). */
status http_download(struct http *http, const char *url_path, const char *path,
                     void (*got)(void *context, uint64_t n, uint64_t n_total), void *context, struct error *err);

#endif
