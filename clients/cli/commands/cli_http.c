#include "clients/cli/commands/cli_http.h"

#include "base/clock.h"

#include <curl/curl.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { MAX_REPLY_BYTES = 64 << 20, CONNECT_TIMEOUT_S = 10, STALL_S = 60, MAX_TRY = 6 };

struct http {
    CURL *curl;
    char *server;        /* as given */
    char *base;          /* begins the address of every request */
    char *authorization; /* "Authorization: Bearer ..." or NULL */
    const volatile sig_atomic_t *stop;
    char why[CURL_ERROR_SIZE];
};

status http_new(const char *server, const char *token, const volatile sig_atomic_t *stop, struct http **http,
                struct error *err)
{
    struct http *h = calloc(1, sizeof *h);
    if (h == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start: out of memory");
    h->curl = curl_easy_init();
    h->server = strdup(server);
    h->base = strdup(strncmp(server, "unix:", 5) == 0 ? "http://localhost" : server);
    h->stop = stop;
    if (token != NULL) {
        size_t n = strlen(token) + sizeof "Authorization: Bearer ";
        h->authorization = malloc(n);
        if (h->authorization != NULL) snprintf(h->authorization, n, "Authorization: Bearer %s", token);
    }
    if (h->curl == NULL || h->server == NULL || h->base == NULL || (token != NULL && h->authorization == NULL)) {
        http_free(h);
        return error_set(err, STATUS_NO_MEMORY, "cannot start libcurl: out of memory");
    }
    for (size_t n = strlen(h->server); n > 8 && h->server[n - 1] == '/'; n--) h->server[n - 1] = '\0';
    for (size_t n = strlen(h->base); n > 8 && h->base[n - 1] == '/'; n--) h->base[n - 1] = '\0';
    *http = h;
    return STATUS_OK;
}

void http_free(struct http *http)
{
    if (http == NULL) return;
    if (http->curl != NULL) curl_easy_cleanup(http->curl);
    free(http->server);
    free(http->base);
    free(http->authorization);
    free(http);
}

const char *http_server(const struct http *http) { return http->server; }
bool http_stopped(const struct http *http) { return http->stop != NULL && *http->stop != 0; }

void http_sleep(const struct http *http, double seconds)
{
    double end = clock_monotonic_s() + seconds;
    while (!http_stopped(http) && clock_monotonic_s() < end) {
        struct timespec nap = {.tv_nsec = 50 * 1000 * 1000};
        nanosleep(&nap, NULL);
    }
}

void http_reply_release(struct http_reply *reply)
{
    free(reply->body);
    reply->body = NULL;
    reply->n_body = reply->n_room = 0;
}

/* ---- callbacks ---- */

static size_t take_body(char *data, size_t size, size_t n, void *context)
{
    struct http_reply *r = context;
    size_t n_new = size * n;
    if (n_new > MAX_REPLY_BYTES - r->n_body) return 0;
    if (r->n_body + n_new + 1 > r->n_room) { /* twice as much each time, or a large body is copied over and over */
        size_t n_room = 2 * (r->n_body + n_new + 1);
        char *grown = realloc(r->body, n_room);
        if (grown == NULL) return 0;
        r->body = grown;
        r->n_room = n_room;
    }
    memcpy(r->body + r->n_body, data, n_new);
    r->n_body += n_new;
    r->body[r->n_body] = '\0';
    return n_new;
}

/* Copies the value of a header line "name: value\r\n" to out. Returns false if it is another header. */
static bool header_value(const char *line, size_t n, const char *name, char *out, size_t n_out)
{
    size_t n_name = strlen(name);
    if (n <= n_name || strncasecmp(line, name, n_name) != 0 || line[n_name] != ':') return false;
    const char *p = line + n_name + 1, *end = line + n;
    while (p < end && (*p == ' ' || *p == '\t')) p++;
    while (end > p && (end[-1] == '\r' || end[-1] == '\n' || end[-1] == ' ')) end--;
    snprintf(out, n_out, "%.*s", (int)(end - p), p);
    return true;
}

static size_t take_header(char *data, size_t size, size_t n, void *context)
{
    struct http_reply *r = context;
    char value[64];
    size_t n_line = size * n;
    header_value(data, n_line, "ETag", r->etag, sizeof r->etag);
    header_value(data, n_line, "Location", r->location, sizeof r->location);
    if (header_value(data, n_line, "Upload-Offset", value, sizeof value)) r->upload_offset = strtoll(value, NULL, 10);
    if (header_value(data, n_line, "Selvedge-Next-Offset", value, sizeof value)) r->log_next = strtoll(value, NULL, 10);
    if (header_value(data, n_line, "Retry-After", value, sizeof value)) r->retry_after_s = strtod(value, NULL);
    return n_line;
}

static int check_stop(void *context, curl_off_t a, curl_off_t b, curl_off_t c, curl_off_t d)
{
    (void)a, (void)b, (void)c, (void)d;
    return http_stopped(context) ? 1 : 0;
}

/* ---- one request ---- */

static struct curl_slist *header_list(const struct http *http, const char *const *header)
{
    struct curl_slist *list = curl_slist_append(NULL, "Expect:");
    if (http->authorization != NULL) list = curl_slist_append(list, http->authorization);
    for (; header != NULL && *header != NULL; header++) list = curl_slist_append(list, *header);
    return list;
}

static status prepare(struct http *http, const char *path, struct http_reply *reply, struct error *err)
{
    char url[2048];
    if (snprintf(url, sizeof url, "%s%s", strncmp(path, "http", 4) == 0 ? "" : http->base, path) >= (int)sizeof url)
        return error_set(err, STATUS_INVALID, "the address '%.60s...' is too long", path);
    CURL *c = http->curl;
    curl_easy_reset(c);
    *reply = (struct http_reply){.upload_offset = -1, .log_next = -1, .retry_after_s = -1.0};
    http->why[0] = '\0';
    curl_easy_setopt(c, CURLOPT_URL, url);
    if (strncmp(http->server, "unix:", 5) == 0) curl_easy_setopt(c, CURLOPT_UNIX_SOCKET_PATH, http->server + 5);
    curl_easy_setopt(c, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(c, CURLOPT_USERAGENT, "selvedge");
    curl_easy_setopt(c, CURLOPT_ERRORBUFFER, http->why);
    curl_easy_setopt(c, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(c, CURLOPT_CONNECTTIMEOUT, (long)CONNECT_TIMEOUT_S);
    curl_easy_setopt(c, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(c, CURLOPT_LOW_SPEED_TIME, (long)STALL_S);
    curl_easy_setopt(c, CURLOPT_WRITEFUNCTION, take_body);
    curl_easy_setopt(c, CURLOPT_WRITEDATA, reply);
    curl_easy_setopt(c, CURLOPT_HEADERFUNCTION, take_header);
    curl_easy_setopt(c, CURLOPT_HEADERDATA, reply);
    curl_easy_setopt(c, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(c, CURLOPT_XFERINFOFUNCTION, check_stop);
    curl_easy_setopt(c, CURLOPT_XFERINFODATA, http);
    return STATUS_OK;
}

static status perform(struct http *http, const char *const *header, struct http_reply *reply, struct error *err)
{
    struct curl_slist *list = header_list(http, header);
    if (list == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a request: out of memory");
    curl_easy_setopt(http->curl, CURLOPT_HTTPHEADER, list);
    CURLcode code = curl_easy_perform(http->curl);
    curl_slist_free_all(list);
    curl_easy_getinfo(http->curl, CURLINFO_RESPONSE_CODE, &reply->code);
    if (code == CURLE_OK) return STATUS_OK;
    if (http_stopped(http)) return error_set(err, STATUS_CANCELLED, "interrupted");
    if (code == CURLE_COULDNT_CONNECT || code == CURLE_COULDNT_RESOLVE_HOST) {
        reply->cut_off = reply->refused = true;
        return error_set(err, STATUS_IO,
                         "cannot reach the server '%s': %s. Start it with `selvedged`, or give its address with "
                         "--server URL or SELVEDGE_SERVER",
                         http->server, http->why[0] != '\0' ? http->why : curl_easy_strerror(code));
    }
    reply->cut_off = code != CURLE_UNSUPPORTED_PROTOCOL && code != CURLE_URL_MALFORMAT && code != CURLE_WRITE_ERROR &&
                     code != CURLE_PEER_FAILED_VERIFICATION;
    /* A reply may have arrived before the connection broke, for example 413 while the body was still being sent. */
    if (reply->code >= 400) return STATUS_OK;
    return error_set(err, STATUS_IO, "the connection to '%s' broke: %s", http->server,
                     http->why[0] != '\0' ? http->why : curl_easy_strerror(code));
}

status http_call(struct http *http, const char *method, const char *path, const char *const *header, const void *body,
                 size_t n_body, struct http_reply *reply, struct error *err)
{
    status s = prepare(http, path, reply, err);
    if (s != STATUS_OK) return s;
    if (strcmp(method, "HEAD") == 0)
        curl_easy_setopt(http->curl, CURLOPT_NOBODY, 1L);
    else
        curl_easy_setopt(http->curl, CURLOPT_CUSTOMREQUEST, method);
    if (body != NULL || strcmp(method, "POST") == 0 || strcmp(method, "PATCH") == 0) {
        curl_easy_setopt(http->curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)n_body);
        curl_easy_setopt(http->curl, CURLOPT_POSTFIELDS, body == NULL ? "" : body);
    }
    return perform(http, header, reply, err);
}

static size_t read_source(char *out, size_t size, size_t n, void *context)
{
    struct http_source *source = context;
    size_t want = size * n;
    if (want > source->n_bytes) want = (size_t)source->n_bytes;
    ssize_t got = want == 0 ? 0 : read(source->fd, out, want);
    if (got < 0 || (got == 0 && want > 0)) return CURL_READFUNC_ABORT;
    source->n_bytes -= (uint64_t)got;
    if (source->sent != NULL) source->sent(source->context, (uint64_t)got);
    return (size_t)got;
}

status http_patch(struct http *http, const char *path, const char *const *header, struct http_source *source,
                  struct http_reply *reply, struct error *err)
{
    status s = prepare(http, path, reply, err);
    if (s != STATUS_OK) return s;
    curl_easy_setopt(http->curl, CURLOPT_UPLOAD, 1L);
    curl_easy_setopt(http->curl, CURLOPT_CUSTOMREQUEST, "PATCH");
    curl_easy_setopt(http->curl, CURLOPT_READFUNCTION, read_source);
    curl_easy_setopt(http->curl, CURLOPT_READDATA, source);
    curl_easy_setopt(http->curl, CURLOPT_INFILESIZE_LARGE, (curl_off_t)source->n_bytes);
    curl_easy_setopt(http->curl, CURLOPT_UPLOAD_BUFFERSIZE, 512L * 1024L);
    return perform(http, header, reply, err);
}

/* ---- answers ---- */

static status code_of(long http_code)
{
    switch (http_code) {
    case 400:
    case 422:
        return STATUS_INVALID;
    case 404:
    case 410:
        return STATUS_NOT_FOUND;
    case 409:
    case 412:
    case 423:
        return STATUS_CONFLICT;
    case 413:
        return STATUS_TOO_LARGE;
    case 415:
        return STATUS_FORMAT;
    case 460:
        return STATUS_CHECKSUM;
    case 507:
        return STATUS_DISK_FULL;
    default:
        return STATUS_IO;
    }
}

status http_problem(const struct http_reply *reply, struct error *err)
{
    status code = code_of(reply->code);
    json_t *problem = reply->n_body == 0 ? NULL : json_loadb(reply->body, reply->n_body, 0, NULL);
    const char *title = json_string_value(json_object_get(problem, "title"));
    const char *detail = json_string_value(json_object_get(problem, "detail"));
    const char *field = json_string_value(json_object_get(problem, "field"));
    const char *name = json_string_value(json_object_get(problem, "code"));
    if (name != NULL && strcmp(name, status_name(STATUS_CHECKSUM)) == 0) code = STATUS_CHECKSUM;
    const char *text = detail != NULL ? detail : title;
    char hint[600];
    if (reply->code == 401 && text != NULL) {
        snprintf(hint, sizeof hint, "%.400s (--token-file FILE, SELVEDGE_TOKEN_FILE or SELVEDGE_TOKEN)", text);
        text = hint;
    }
    if (reply->code == 401 && text == NULL) text = "the server requires an access token; set SELVEDGE_TOKEN_FILE";
    size_t n_more = json_array_size(json_object_get(problem, "errors"));
    if (text != NULL && n_more > 1)
        error_set_field(err, code, field == NULL ? "" : field,
                        "%s; the document has %zu faults in all, `selvedge check` lists them", text, n_more);
    else if (text != NULL)
        error_set_field(err, code, field == NULL ? "" : field, "%s", text);
    else
        error_set(err, code, "the server replied with HTTP status %ld and no explanation", reply->code);
    json_decref(problem);
    return code;
}

static bool busy(const struct http_reply *reply)
{
    return (reply->code == 429 || reply->code == 503) && reply->retry_after_s >= 0.0;
}

status http_json(struct http *http, const char *method, const char *path, const char *key, const json_t *body,
                 json_t **out, struct error *err)
{
    char key_line[160];
    const char *header[4] = {"Accept: application/json"};
    size_t n_header = 1;
    if (body != NULL) header[n_header++] = "Content-Type: application/json";
    if (key != NULL) {
        snprintf(key_line, sizeof key_line, "Idempotency-Key: %s", key);
        header[n_header++] = key_line;
    }
    char *text = body == NULL ? NULL : json_dumps(body, JSON_COMPACT);
    /* every call except creating a job without a key has the same effect if repeated */
    bool repeatable = key != NULL || strcmp(path, "/v1/jobs") != 0;
    struct http_reply reply = {0};
    status s = STATUS_OK;
    if (out != NULL) *out = NULL;
    for (int i_try = 0; i_try < MAX_TRY; i_try++) {
        http_reply_release(&reply);
        s = http_call(http, method, path, header, text, text == NULL ? 0 : strlen(text), &reply, err);
        if (s == STATUS_OK && busy(&reply))
            http_sleep(http, reply.retry_after_s < 30.0 ? reply.retry_after_s : 30.0);
        else if (s != STATUS_OK && reply.refused) /* a daemon may be starting; nothing was sent */
            http_sleep(http, 0.5);
        else if (s != STATUS_OK && reply.cut_off && repeatable)
            http_sleep(http, 0.5 * (i_try + 1));
        else
            break;
    }
    if (s != STATUS_OK) goto out;
    if (reply.code < 200 || reply.code > 299) {
        s = http_problem(&reply, err);
    } else if (out != NULL && reply.n_body > 0) {
        *out = json_loadb(reply.body, reply.n_body, 0, NULL);
        if (*out == NULL)
            s = error_set(err, STATUS_FORMAT, "'%s' is not a selvedge server: its reply is not JSON", http->server);
    }
out:
    http_reply_release(&reply);
    free(text);
    return s;
}
