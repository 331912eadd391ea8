#include "server/http/http_guard.h"
#include "server/http/http_listen.h"
#include "server/http/http_reply.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const single[] = {"Content-Length", "Host",          "Transfer-Encoding", "Content-Type",
                                     "Upload-Offset",  "Tus-Resumable", "Idempotency-Key",   "Origin",
                                     "If-Match",       "Range",         "Authorization"};
enum { N_SINGLE = sizeof single / sizeof single[0] };

struct headers_seen {
    unsigned n[N_SINGLE];
    const char *fault; /* Returns the fault of a header, or NULL. */
};

static bool name_valid(const char *name, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        unsigned char c = (unsigned char)name[i];
        if (c <= ' ' || c >= 127 || strchr("\"(),/:;<=>?@[\\]{}", c) != NULL) return false;
    }
    return n > 0;
}

/* The library ends a value at its first NUL, and puts the continuation of a folded line behind the header's name. After
 * the NUL that it writes over the line's CR follows the one that it writes over the LF; each line is followed by
 * another one in the same buffer, so this byte can be read. */
static enum MHD_Result examine_header(void *context, enum MHD_ValueKind kind, const char *name, size_t n_name,
                                      const char *value, size_t n_value)
{
    struct headers_seen *seen = context;
    (void)kind;
    if (!name_valid(name, n_name))
        seen->fault = "the name of a header has characters that are not allowed";
    else if (value == NULL || memchr(value, '\r', n_value) != NULL || value[n_value + 1] != '\0')
        seen->fault = "the value of a header has a CR or NUL, or its line does not end with CR LF";
    for (size_t i = 0; i < N_SINGLE; i++) {
        size_t n = strlen(single[i]);
        if (n_name < n || strncasecmp(name, single[i], n) != 0) continue;
        if (n_name == n)
            seen->n[i]++;
        else if (i == 0 || i == 2)
            seen->fault = "a header that delimits the body is folded";
    }
    return seen->fault == NULL ? MHD_YES : MHD_NO;
}

/* The library takes the parts of the first line as texts, and each would end at a NUL before its end. */
static const char *line_fault(const struct http_request *r, const char *method, const char *version)
{
    const char *at = method + strlen(method) + 1;
    while (at < r->address && *at == ' ') at++;
    if (at != r->address || r->address_spaced || version != r->address_end + 1)
        return "the first line has NUL, other control characters or blanks in its method or its address";
    return NULL;
}

bool guard_line(struct http_request *r, const char *method, const char *version)
{
    const char *fault = line_fault(r, method, version);
    if (fault == NULL && request_header(r, "Host") == NULL && strcmp(version, "HTTP/1.1") == 0)
        fault = "a request of this version needs the header Host";
    if (fault != NULL) reply_code(r, "malformed", "", fault);
    return fault == NULL;
}

bool guard_framing(struct http_request *r)
{
    struct headers_seen seen = {0};
    const unsigned *n = seen.n;
    MHD_get_connection_values_n(r->connection, MHD_HEADER_KIND, examine_header, &seen);
    if (seen.fault != NULL) {
        reply_code(r, "malformed", "", seen.fault);
        return false;
    }
    if (n[0] > 0 && n[2] > 0) {
        reply_code(r, "length_and_chunked", "Content-Length",
                   "Content-Length and Transfer-Encoding together make the end of the body ambiguous");
        return false;
    }
    for (size_t i = 0; i < N_SINGLE; i++)
        if (n[i] > 1) {
            reply_code(r, "duplicate_header", single[i], "this header may appear only once");
            return false;
        }
    if (n[2] > 0) {
        reply_code(r, "length_required", "Transfer-Encoding",
                   "chunked requests are not accepted; send a Content-Length");
        return false;
    }
    const char *text = request_header(r, "Content-Length");
    r->content_length = 0;
    if (text == NULL) return true;
    size_t digits = strspn(text, "0123456789");
    if (digits == 0 || digits > 18 || text[digits] != '\0') {
        reply_code(r, "malformed", "Content-Length", "Content-Length is not a number");
        return false;
    }
    r->content_length = strtoll(text, NULL, 10);
    return true;
}

bool guard_site(struct http_request *r, const char *method)
{
    const char *host = request_header(r, "Host"), *origin = request_header(r, "Origin");
    if (host != NULL && !http_host_known(r->service->settings, host)) {
        reply_code(r, "host", "Host",
                   "this service accepts only requests to localhost, 127.0.0.1, [::1] and its server.public_origin");
        return false;
    }
    bool reads = strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0 || strcmp(method, "OPTIONS") == 0;
    if (reads || origin == NULL) return true;
    if (http_origin_known(r->service->settings, origin, host)) return true;
    reply_code(r, "origin", "Origin", "a page of another site must not change anything here");
    return false;
}

/* Compares a Content-Type without its parameters. */
static bool type_is(const char *header, const char *want)
{
    size_t n = strlen(want);
    return header != NULL && strncasecmp(header, want, n) == 0 &&
           (header[n] == '\0' || header[n] == ';' || header[n] == ' ');
}

static void too_large(struct http_request *r, long long most)
{
    struct error err = {0};
    error_set_field(&err, STATUS_TOO_LARGE, "Content-Length", "the body has %lld bytes, but at most %lld are accepted",
                    (long long)r->content_length, most);
    reply_problem(r, NULL, &err, json_pack("{s:I}", "max_bytes", (json_int_t)most));
}

bool guard_body(struct http_request *r)
{
    if (r->route->body == HTTP_BODY_NONE) return true;
    const struct settings *s = r->service->settings;
    bool json = r->route->body != HTTP_BODY_UPLOAD;
    long long most = r->route->body == HTTP_BODY_BATCH ? s->max_batch_bytes
                     : json                            ? s->max_document_bytes
                                                       : s->max_patch_bytes;
    if (request_header(r, "Content-Length") == NULL)
        reply_code(r, "length_required", "Content-Length", "a body with a Content-Length is required");
    else if (!type_is(request_header(r, "Content-Type"), json ? "application/json" : "application/offset+octet-stream"))
        reply_code(r, "content_type", "Content-Type",
                   json ? "Content-Type must be application/json"
                        : "Content-Type must be application/offset+octet-stream");
    else if (r->content_length > most)
        too_large(r, most);
    return r->reply == NULL;
}

struct query_seen {
    const char *known;
    char name[64]; /* of the parameter at fault; "": none */
    bool twice;
    const char *seen[32];
    size_t n;
};

/* Returns whether a list with spaces has the name. */
static bool listed(const char *names, const char *name)
{
    size_t n = strlen(name);
    for (const char *at = names; n > 0 && (at = strstr(at, name)) != NULL; at += n)
        if ((at == names || at[-1] == ' ') && (at[n] == ' ' || at[n] == '\0')) return true;
    return false;
}

static enum MHD_Result examine_parameter(void *context, enum MHD_ValueKind kind, const char *name, const char *value)
{
    struct query_seen *q = context;
    (void)kind, (void)value;
    for (size_t i = 0; i < q->n; i++) q->twice = q->twice || strcmp(q->seen[i], name) == 0;
    if (listed(q->known, name) && !q->twice && q->n < sizeof q->seen / sizeof q->seen[0]) {
        q->seen[q->n++] = name;
        return MHD_YES;
    }
    snprintf(q->name, sizeof q->name, "%s", name[0] == '\0' ? "?" : name);
    for (char *c = q->name; *c != '\0'; c++)
        if (*c < ' ' || *c > '~') *c = '?'; /* also if it is no UTF-8 */
    return MHD_NO;
}

bool guard_query(struct http_request *r)
{
    struct query_seen q = {.known = r->route->query};
    struct error err = {0};
    if (q.known == NULL) return true;
    MHD_get_connection_values(r->connection, MHD_GET_ARGUMENT_KIND, examine_parameter, &q);
    if (q.name[0] == '\0') return true;
    if (q.twice)
        error_set_field(&err, STATUS_INVALID, q.name, "query parameter '%s' is given twice", q.name);
    else if (q.known[0] == '\0')
        error_set_field(&err, STATUS_INVALID, q.name, "there is no query parameter '%s' here", q.name);
    else
        error_set_field(&err, STATUS_INVALID, q.name, "there is no query parameter '%s' here; known are: %s", q.name,
                        q.known);
    reply_problem(r, NULL, &err, NULL);
    return false;
}
