#include "server/http/http_reply.h"
#include "server/jobs/problem_code.h"

#include <errno.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Content Security Policies. */
static const char policy_header[] = "Content-Security-Policy";
#define POLICY_COMMON "object-src 'none'; base-uri 'none'; frame-ancestors 'none'"
static const char *const policy_text[] = {
    [POLICY_SANDBOX] =
        "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'; form-action 'none'; " POLICY_COMMON,
    /* Without allow-scripts a page of this origin can do nothing in its name. Pages with pictures beside them need the
     * origin, because browsers send the session's cookie to no other. */
    [POLICY_SANDBOX_PAGE] = "sandbox allow-same-origin; default-src 'none'; img-src 'self' data:; style-src 'self' "
                            "'unsafe-inline'; form-action 'none'; " POLICY_COMMON,
    [POLICY_DASHBOARD] = "default-src 'self'; img-src 'self' data: blob:; form-action 'self'; " POLICY_COMMON,
};

const char *request_header(const struct http_request *r, const char *name)
{
    return MHD_lookup_connection_value(r->connection, MHD_HEADER_KIND, name);
}

void reply_header(struct http_request *r, const char *name, const char *value)
{
    if (r->reply != NULL) MHD_add_response_header(r->reply, name, value);
}

void reply_header_int(struct http_request *r, const char *name, long long value)
{
    char text[32];
    snprintf(text, sizeof text, "%lld", value);
    reply_header(r, name, text);
}

void reply_response(struct http_request *r, unsigned status_code, struct MHD_Response *response)
{
    if (r->reply != NULL) MHD_destroy_response(r->reply);
    r->reply = response;
    r->reply_status = status_code;
    if (response == NULL) return;
    reply_header(r, "X-Content-Type-Options", "nosniff");
    reply_header(r, "Referrer-Policy", "no-referrer");
    reply_header(r, policy_header, policy_text[POLICY_SANDBOX]);
    reply_header(r, "Cross-Origin-Resource-Policy", "same-origin");
    reply_header(r, "Tus-Resumable", "1.0.0");
}

void reply_policy(struct http_request *r, enum reply_policy policy)
{
    if (r->reply == NULL) return;
    MHD_del_response_header(r->reply, policy_header, MHD_get_response_header(r->reply, policy_header));
    reply_header(r, policy_header, policy_text[policy]);
}

void reply_empty(struct http_request *r, unsigned status_code)
{
    reply_response(r, status_code, MHD_create_response_from_buffer(0, (void *)(uintptr_t) "", MHD_RESPMEM_PERSISTENT));
}

void reply_text(struct http_request *r, unsigned status_code, const char *content_type, const char *text, size_t n)
{
    reply_response(r, status_code, MHD_create_response_from_buffer(n, (void *)(uintptr_t)text, MHD_RESPMEM_MUST_COPY));
    reply_header(r, "Content-Type", content_type);
}

void reply_json(struct http_request *r, unsigned status_code, json_t *body)
{
    char *text = json_dumps(body, JSON_COMPACT);
    json_decref(body);
    if (text == NULL) { /* the body contains text that is not UTF-8, or memory is out */
        reply_code(r, "internal", "", "the reply cannot be written as JSON");
        return;
    }
    reply_response(r, status_code, MHD_create_response_from_buffer(strlen(text), text, MHD_RESPMEM_MUST_FREE));
    reply_header(r, "Content-Type", "application/json");
    reply_header(r, "Cache-Control", "no-cache");
}

void reply_no_store(struct http_request *r)
{
    if (r->reply == NULL) return;
    MHD_del_response_header(r->reply, "Cache-Control", "no-cache");
    reply_header(r, "Cache-Control", "no-store");
}

static void json_tag(const json_t *body, char out[40])
{
    unsigned char sum[16] = {0};
    char hex[33], *text = json_dumps(body, JSON_COMPACT);
    if (text != NULL) crypto_generichash(sum, sizeof sum, (const unsigned char *)text, strlen(text), NULL, 0);
    sodium_bin2hex(hex, sizeof hex, sum, sizeof sum);
    snprintf(out, 40, "\"%s\"", hex);
    free(text);
}

bool tag_matches(const char *header, const char *tag)
{
    if (header == NULL) return false;
    if (strcmp(header, "*") == 0) return true;
    size_t n = strlen(tag);
    for (const char *at = header; (at = strstr(at, tag)) != NULL; at += n)
        if (at[n] == '\0' || at[n] == ',' || at[n] == ' ') return true;
    return false;
}

bool reply_not_modified(struct http_request *r, const char *tag)
{
    if (!tag_matches(request_header(r, "If-None-Match"), tag)) return false;
    reply_empty(r, MHD_HTTP_NOT_MODIFIED);
    reply_header(r, "ETag", tag);
    reply_header(r, "Cache-Control", "no-cache");
    return true;
}

void reply_json_tagged(struct http_request *r, json_t *body)
{
    char tag[40];
    json_tag(body, tag);
    if (reply_not_modified(r, tag)) {
        json_decref(body);
        return;
    }
    reply_json(r, MHD_HTTP_OK, body);
    reply_header(r, "ETag", tag);
}

void reply_problem(struct http_request *r, const char *code, const struct error *err, json_t *extra)
{
    const struct http_problem *p = code != NULL ? http_problem_of_code(code) : http_problem_of_status(err->code);
    char type[96];
    snprintf(type, sizeof type, "urn:selvedge:problem:%s", p->code);
    json_t *body =
        json_pack("{s:s,s:s,s:i,s:s}", "type", type, "title", p->title, "status", (int)p->status, "code", p->code);
    json_t *detail = json_string(err->text); /* NULL when the text quotes a name that is not UTF-8 */
    json_object_set_new(body, "detail", detail != NULL ? detail : json_string(p->title));
    if (err->field[0] != '\0') json_object_set_new(body, "field", json_string(err->field));
    if (extra != NULL) json_object_update(body, extra);
    json_decref(extra);
    reply_json(r, p->status, body);
    reply_header(r, "Content-Type", "application/problem+json");
    if (r->reply != NULL) MHD_del_response_header(r->reply, "Content-Type", "application/json");
}

void reply_code(struct http_request *r, const char *code, const char *field, const char *detail)
{
    struct error err = {0};
    snprintf(err.field, sizeof err.field, "%s", field);
    snprintf(err.text, sizeof err.text, "%s", detail);
    reply_problem(r, code, &err, NULL);
}

bool query_integer(struct http_request *r, const char *name, long long least, long long most, long long fallback,
                   long long *out)
{
    const char *text = MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, name);
    *out = fallback;
    if (text == NULL) return true;
    char *end;
    errno = 0;
    *out = strtoll(text, &end, 10);
    if (*text != '\0' && *end == '\0' && errno == 0 && *out >= least && *out <= most) return true;
    struct error err = {0};
    error_set_field(&err, STATUS_INVALID, name,
                    "query parameter '%s' is '%.40s'; it must be a whole number from %lld to %lld", name, text, least,
                    most);
    reply_problem(r, NULL, &err, NULL);
    return false;
}

/* Returns 0 if there is no usable range (the whole file is sent), 1 for the range [*from, *to] inclusive, -1 if the
 * range is outside the file. */
static int parse_range(const char *header, long long size, long long *from, long long *to)
{
    char *end;
    if (header == NULL || strncmp(header, "bytes=", 6) != 0 || strchr(header, ',') != NULL) return 0;
    const char *at = header + 6;
    errno = 0;
    if (*at == '-') {
        long long n = strtoll(at + 1, &end, 10);
        if (at[1] < '0' || at[1] > '9' || *end != '\0' || errno != 0) return 0;
        if (n == 0 || size == 0) return -1;
        *from = n >= size ? 0 : size - n;
        *to = size - 1;
        return 1;
    }
    if (*at < '0' || *at > '9') return 0;
    *from = strtoll(at, &end, 10);
    if (*end != '-' || errno != 0) return 0;
    at = end + 1;
    *to = size - 1;
    if (*at != '\0') {
        if (*at < '0' || *at > '9') return 0;
        long long last = strtoll(at, &end, 10);
        if (*end != '\0' || errno != 0 || last < *from) return 0;
        if (last < *to) *to = last;
    }
    return *from >= size ? -1 : 1;
}

static void file_headers(struct http_request *r, const struct stat *st, const char *tag, const char *content_type)
{
    char modified[64];
    struct tm utc;
    gmtime_r(&st->st_mtim.tv_sec, &utc);
    strftime(modified, sizeof modified, "%a, %d %b %Y %H:%M:%S GMT", &utc);
    reply_header(r, "ETag", tag);
    reply_header(r, "Last-Modified", modified);
    reply_header(r, "Content-Type", content_type);
    reply_header(r, "Accept-Ranges", "bytes");
    reply_header(r, "Cache-Control", "no-cache");
}

void reply_file(struct http_request *r, int fd, const char *content_type)
{
    struct stat st;
    char tag[80], text[96];
    if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode)) {
        close(fd);
        reply_code(r, "internal", "", "the file cannot be read");
        return;
    }
    long long size = (long long)st.st_size, from = 0, to = size - 1;
    snprintf(tag, sizeof tag, "\"%llx-%llx-%llx\"", (unsigned long long)st.st_ino, (unsigned long long)size,
             (unsigned long long)st.st_mtim.tv_sec * 1000000000ULL + (unsigned long long)st.st_mtim.tv_nsec);
    const char *if_range = request_header(r, "If-Range");
    if (reply_not_modified(r, tag)) {
        close(fd);
        return;
    }
    int range =
        if_range != NULL && strcmp(if_range, tag) != 0 ? 0 : parse_range(request_header(r, "Range"), size, &from, &to);
    if (range < 0) {
        close(fd);
        reply_code(r, "range", "Range", "the range begins after the end of the file");
        snprintf(text, sizeof text, "bytes */%lld", size);
        reply_header(r, "Content-Range", text);
        return;
    }
    uint64_t n = range == 1 ? (uint64_t)(to - from + 1) : (uint64_t)size;
    struct MHD_Response *response = MHD_create_response_from_fd_at_offset64(n, fd, range == 1 ? (uint64_t)from : 0);
    if (response == NULL) close(fd);
    reply_response(r, range == 1 ? MHD_HTTP_PARTIAL_CONTENT : MHD_HTTP_OK, response);
    file_headers(r, &st, tag, content_type);
    snprintf(text, sizeof text, "bytes %lld-%lld/%lld", from, to, size);
    if (range == 1) reply_header(r, "Content-Range", text);
}
