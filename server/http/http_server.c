#include "server/http/http_server.h"
#include "server/http/access_guard.h"
#include "server/http/connection_table.h"
#include "server/http/http_guard.h"
#include "server/http/http_listen.h"
#include "server/http/http_reply.h"
#include "server/http/http_tls.h"
#include "server/http/library_refusal.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    CONNECTION_POOL_BYTES = 256 * 1024,
    THREAD_STACK_BYTES = 2 << 20, /* the JSON parser goes 2,048 levels deep */
    DRAIN_LIMIT_BYTES = 64 << 20,
    RETRY_AFTER_S = 5
};

struct http_server {
    struct job_service *service;
    http_route_finder *find_route;
    const struct static_files *files;
    struct MHD_Daemon *daemon;
    struct connection_table *connection;
    struct access_registry *registry;
    struct http_tls tls;
    atomic_int_least64_t body_memory; /* bytes that the bodies of all requests take */
    atomic_uint_least64_t n_reply[HTTP_MAX_STATUS];
};

const struct static_files *http_server_files(const struct http_server *s) { return s->files; }
size_t http_server_n_connection(const struct http_server *s) { return connection_table_count(s->connection); }
uint64_t http_server_n_reply(const struct http_server *s, unsigned status_code)
{
    return status_code < HTTP_MAX_STATUS ? atomic_load(&s->n_reply[status_code]) : 0;
}

void http_server_reap(struct http_server *s)
{
    connection_table_reap(s->connection);
    access_registry_flush(s->registry, false);
}

static enum MHD_Result queue_reply(struct http_request *r)
{
    if (r->reply == NULL) reply_code(r, "internal", "", "the request has no reply");
    if (r->reply == NULL) return MHD_NO; /* out of memory: close the connection */
    connection_sending(r->server->connection, r->entry);
    r->queued = true;
    if (r->reply_status < HTTP_MAX_STATUS) atomic_fetch_add(&r->server->n_reply[r->reply_status], 1);
    return MHD_queue_response(r->connection, r->reply_status, r->reply);
}

/* Takes the memory for a JSON body until release_body. Returns false after a reply if the bodies of other requests
 * leave less than it needs; late ones are ended then, so that the client's next try has room. Where there are no other
 * bodies, any body has room. */
static bool take_memory(struct http_request *r)
{
    if (r->route->body != HTTP_BODY_JSON && r->route->body != HTTP_BODY_BATCH) return true;
    atomic_int_least64_t *taken = &r->server->body_memory;
    int64_t before = atomic_fetch_add(taken, r->content_length);
    if (before > 0 && before + r->content_length > r->service->settings->body_memory_bytes) {
        atomic_fetch_sub(taken, r->content_length);
        connection_table_end_late(r->server->connection);
        reply_code(r, "busy", "", "the bodies of other requests take all memory for bodies; try again in a moment");
        reply_header_int(r, "Retry-After", RETRY_AFTER_S);
        return false;
    }
    r->body_memory = r->content_length;
    connection_in_memory(r->server->connection, r->entry, r->content_length);
    return true;
}

static void release_body(struct http_request *r)
{
    free(r->body);
    r->body = NULL;
    atomic_fetch_sub(&r->server->body_memory, r->body_memory);
    r->body_memory = 0;
}

/* Decides the reply to requests that can be refused before their body is read. Returns true if the reply must be
 * sent without waiting for the body. */
static bool examine(struct http_request *r, const char *method, const char *version)
{
    char allow[128];
    if (!guard_line(r, method, version) || !guard_framing(r)) return true;
    bool skip_body = request_header(r, "Expect") != NULL || r->content_length > DRAIN_LIMIT_BYTES;
    if (atomic_load(&r->service->stopping)) {
        reply_code(r, "stopping", "", "the service is stopping; try again in a moment");
        return skip_body;
    }
    if (!guard_site(r, method)) return skip_body;
    r->route = r->server->find_route(method, r->url, r->param, allow, sizeof allow);
    if (r->route == NULL && allow[0] == '\0')
        reply_code(r, "not_found", "", "there is nothing at this address");
    else if (r->route == NULL) {
        reply_code(r, "method", "", "this address accepts other methods; see Allow");
        reply_header(r, "Allow", allow);
    } else if (guard_access(r) && guard_query(r) && guard_body(r) && take_memory(r) && r->route->begin != NULL)
        r->route->begin(r);
    /* without a length nobody knows where the next request begins */
    return r->reply != NULL && (skip_body || r->reply_status == MHD_HTTP_LENGTH_REQUIRED);
}

/* The library calls this with the address as it came, before it reads the headers. */
static void *on_address(void *context, const char *address, struct MHD_Connection *c)
{
    struct http_server *s = context;
    struct http_request *r = calloc(1, sizeof *r);
    if (r == NULL) return NULL;
    r->server = s;
    r->service = s->service;
    r->registry = s->registry;
    r->connection = c;
    r->address = address;
    r->address_end = address;
    for (; *r->address_end != '\0'; r->address_end++)
        r->address_spaced = r->address_spaced || (unsigned char)*r->address_end <= ' ' || *r->address_end == 127;
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(c, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    r->entry = info == NULL ? NULL : info->socket_context;
    connection_bind(s->connection, r->entry, c);
    return r;
}

static enum MHD_Result first_call(struct http_request *r, const char *url, const char *method, const char *version)
{
    struct http_server *s = r->server;
    r->begun = true;
    r->url = url;
    connection_body_begins(s->connection, r->entry);
    bool now = examine(r, method, version);
    if (r->reply == NULL && r->route != NULL &&
        (r->route->body == HTTP_BODY_JSON || r->route->body == HTTP_BODY_BATCH)) {
        r->body = malloc((size_t)r->content_length + 1);
        if (r->body == NULL) return MHD_NO;
        r->body[0] = '\0';
    }
    if (!now) return MHD_YES;
    reply_header(r, "Connection", "close");
    return queue_reply(r);
}

/* Accepts a piece of the body. Returns false if the connection must be closed. */
static bool consume(struct http_request *r, const char *data, size_t n)
{
    if (r->reply != NULL) return true; /* the reply is already decided, so the body is discarded */
    if (r->upload != NULL) {
        if (r->upload_status == STATUS_OK)
            r->upload_status = upload_write(r->upload, r->ticket, data, n, &r->upload_error);
        return r->upload_status != STATUS_STALE;
    }
    if (r->body == NULL) return true;
    if (n > (size_t)r->content_length - r->n_body) return false;
    memcpy(r->body + r->n_body, data, n);
    r->n_body += n;
    r->body[r->n_body] = '\0';
    return true;
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *c, const char *url, const char *method,
                                  const char *version, const char *data, size_t *n_data, void **request)
{
    struct http_request *r = *request;
    (void)context;
    (void)c;
    if (r == NULL) return MHD_NO; /* out of memory */
    if (!r->begun) return first_call(r, url, method, version);
    if (*n_data > 0) {
        connection_received(r->entry, *n_data);
        bool go_on = consume(r, data, *n_data);
        connection_stored(r->entry);
        *n_data = 0;
        return go_on ? MHD_YES : MHD_NO;
    }
    if (r->queued) return MHD_YES;
    connection_working(r->server->connection, r->entry);
    if (r->reply == NULL) r->route->handle(r);
    release_body(r);
    return queue_reply(r);
}

static void on_completed(void *context, struct MHD_Connection *c, void **request, enum MHD_RequestTerminationCode why)
{
    struct http_server *s = context;
    struct http_request *r = *request;
    (void)c;
    (void)why;
    if (r == NULL) return;
    if (r->upload != NULL) r->route->abandon(r);
    if (r->reply != NULL) MHD_destroy_response(r->reply);
    connection_idle(s->connection, r->entry);
    release_body(r);
    free(r);
    *request = NULL;
}

static void on_connection(void *context, struct MHD_Connection *c, void **socket_context,
                          enum MHD_ConnectionNotificationCode code)
{
    struct http_server *s = context;
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info = MHD_get_connection_info(c, MHD_CONNECTION_INFO_CONNECTION_FD);
        *socket_context = info == NULL ? NULL : connection_opened(s->connection, info->connect_fd);
    } else {
        connection_closed(s->connection, *socket_context);
        *socket_context = NULL;
    }
}

static int hex_value(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Decodes %XX like the library's function but leaves %00 as it is, so that a name cannot end before its end. */
static size_t unescape(void *context, struct MHD_Connection *c, char *text)
{
    (void)context;
    (void)c;
    char *out = text;
    for (const char *in = text; *in != '\0'; out++) {
        int high = *in == '%' ? hex_value(in[1]) : -1, low = high >= 0 ? hex_value(in[2]) : -1;
        if (low >= 0 && high + low > 0) {
            *out = (char)(high * 16 + low);
            in += 3;
        } else
            *out = *in++;
    }
    *out = '\0';
    return (size_t)(out - text);
}

static void on_library_log(void *context, const char *format, va_list args) __attribute__((format(printf, 2, 0)));
static void on_library_log(void *context, const char *format, va_list args)
{
    struct http_server *s = context;
    char text[512];
    unsigned status_code = library_refusal_of(format, args);
    if (status_code > 0) library_refusal_answer(s->connection, http_tls_wanted(s->service->settings), status_code);
    vsnprintf(text, sizeof text, format, args);
    log_write(s->service->log, LOG_LEVEL_DEBUG, "http: %s", text);
}

/* The library calls this when its state is inconsistent. The process ends; the state of all jobs is on disk. */
static void on_panic(void *context, const char *file, unsigned line, const char *reason)
{
    log_error(context, "the HTTP library failed at %s:%u: %s", file, line, reason == NULL ? "" : reason);
    abort();
}

status http_server_start(struct job_service *service, http_route_finder *find_route, const struct static_files *files,
                         struct http_server **out, char url[LISTEN_URL_BYTES], struct error *err)
{
    const struct settings *settings = service->settings;
    int fd = -1;
    struct http_server *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start the server: out of memory");
    s->service = service;
    s->find_route = find_route;
    s->files = files;
    status result = connection_table_new((double)settings->header_deadline_s, settings->min_rate_bytes_per_s,
                                         !http_tls_wanted(settings), &s->connection, err);
    if (result == STATUS_OK) result = http_tls_read(settings, &s->tls, err);
    if (result == STATUS_OK) result = access_registry_new(service->store, settings, &s->registry, err);
    bool guarded = false;
    if (result == STATUS_OK) result = access_required(s->registry, &guarded, err);
    if (result == STATUS_OK) result = http_listen(settings, guarded, &fd, url, err);
    if (result != STATUS_OK) goto out;
    struct MHD_OptionItem tls[] = {{MHD_OPTION_HTTPS_MEM_CERT, 0, s->tls.certificate},
                                   {MHD_OPTION_HTTPS_MEM_KEY, 0, s->tls.key},
                                   {MHD_OPTION_END, 0, NULL}};
    const struct MHD_OptionItem none = {MHD_OPTION_END, 0, NULL};
    if (!http_tls_wanted(settings)) tls[0] = none;
    MHD_set_panic_func(on_panic, service->log);
    s->daemon = MHD_start_daemon(
        (http_tls_wanted(settings) ? MHD_USE_TLS : 0) | MHD_USE_THREAD_PER_CONNECTION | MHD_USE_POLL_INTERNAL_THREAD |
            MHD_USE_ERROR_LOG | MHD_USE_ITC,
        0, NULL, NULL, on_request, s, MHD_OPTION_EXTERNAL_LOGGER, on_library_log, s, MHD_OPTION_LISTEN_SOCKET, fd,
        MHD_OPTION_THREAD_STACK_SIZE, (size_t)THREAD_STACK_BYTES, MHD_OPTION_CONNECTION_LIMIT,
        (unsigned)settings->max_connections, MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)settings->idle_timeout_s,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)CONNECTION_POOL_BYTES, MHD_OPTION_NOTIFY_COMPLETED, on_completed, s,
        MHD_OPTION_NOTIFY_CONNECTION, on_connection, s, MHD_OPTION_UNESCAPE_CALLBACK, unescape, s,
        MHD_OPTION_URI_LOG_CALLBACK, on_address, s, MHD_OPTION_STRICT_FOR_CLIENT, 0, MHD_OPTION_SIGPIPE_HANDLED_BY_APP,
        1, MHD_OPTION_ARRAY, tls, MHD_OPTION_END);
    if (s->daemon == NULL) {
        close(fd);
        result = http_tls_wanted(settings)
                     ? error_set_field(err, STATUS_INVALID, "server.tls_certificate",
                                       "cannot start the HTTP server with certificate '%s' and key '%s'",
                                       settings->tls_certificate, settings->tls_key)
                     : error_set_errno(err, "cannot start the HTTP server");
    }
out:
    if (result != STATUS_OK)
        http_server_stop(s);
    else
        *out = s;
    return result;
}

void http_server_stop(struct http_server *s)
{
    if (s == NULL) return;
    if (s->daemon != NULL) {
        http_listen_end(
            s->service->settings); /* while the socket is open, so that no other process owns the file yet */
        MHD_stop_daemon(s->daemon);
    }
    connection_table_free(s->connection);
    access_registry_free(s->registry);
    http_tls_release(&s->tls);
    free(s);
}
