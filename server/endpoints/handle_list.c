/* The list of jobs: filters, orders, pages, and rows that a client may have already. */
#include "server/endpoints/handlers.h"
#include "server/endpoints/verdict_filter.h"
#include "server/http/http_reply.h"
#include "server/http/long_poll.h"
#include "server/views/job_row_view.h"
#include "server/views/job_view.h"

#include <errno.h>
#include <math.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LIST_MOST = 500, LIST_USUAL = 50, CURSOR_BYTES = 24 + 2 * STORE_KEY_BYTES };

/* The parameters of a request for the list. */
struct list_request {
    struct job_query query;
    bool rows;        /* short rows instead of summaries */
    const char *have; /* digests of the rows that the client has, between commas; NULL: none */
    char verdict[VERDICT_FILTER_BYTES], key[STORE_KEY_BYTES];
};

static const char *given(struct http_request *r, const char *name)
{
    return MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, name);
}

static bool refuse(struct http_request *r, const char *field, const char *what, const char *value)
{
    struct error err = {0};
    char shown[41];
    snprintf(shown, sizeof shown, "%s", value);
    for (char *c = shown; *c != '\0'; c++)
        if (*c < ' ' || *c > '~') *c = '?';
    error_set_field(&err, STATUS_INVALID, field, "query parameter '%s' is '%s'; %s", field, shown, what);
    reply_problem(r, NULL, &err, NULL);
    return false;
}

static bool read_states(struct http_request *r, struct job_query *q)
{
    const char *text = given(r, "state");
    if (text == NULL) return true;
    for (const char *at = text;; at++) {
        char word[16];
        enum job_state state;
        size_t n = strcspn(at, ",");
        snprintf(word, sizeof word, "%.*s", (int)(n < sizeof word ? n : sizeof word - 1), at);
        if (!job_state_parse(word, &state))
            return refuse(r, "state", "it must be states between commas, as in 'queued,running'", text);
        q->states |= 1U << state;
        at += n;
        if (*at == '\0') return true;
    }
}

static bool read_verdicts(struct http_request *r, struct list_request *l)
{
    if (!verdict_filter_read(r, l->verdict)) return false;
    if (l->verdict[0] != '\0') l->query.verdict = l->verdict;
    return true;
}

static bool read_time(struct http_request *r, const char *name, double *unix_s)
{
    char *end;
    const char *text = given(r, name);
    if (text == NULL) return true;
    *unix_s = strtod(text, &end);
    if (end != text && *end == '\0' && isfinite(*unix_s) && *unix_s >= 0 && *unix_s < 1e12) return true;
    return refuse(r, name, "it must be seconds since 1970", text);
}

static bool read_order(struct http_request *r, struct job_query *q)
{
    static const char *const known[] = {"created", "finished", "sample"};
    const char *sort = given(r, "sort"), *order = given(r, "order");
    size_t i = 0;
    while (sort != NULL && i < 3 && strcmp(sort, known[i]) != 0) i++;
    if (i == 3) return refuse(r, "sort", "it must be created, finished or sample", sort);
    q->order = (enum job_order)i;
    if (order != NULL && strcmp(order, "asc") != 0 && strcmp(order, "desc") != 0)
        return refuse(r, "order", "it must be asc or desc", order);
    q->ascending = order != NULL && order[0] == 'a';
    return true;
}

/* A cursor is the serial number of the last job and, unless the list is in the order of creation, a dot and the key of
 * the order in hexadecimal. */
static bool read_cursor(struct http_request *r, struct list_request *l)
{
    static const char what[] = "it must be a next_cursor of the same list";
    const char *text = given(r, "cursor");
    char *end;
    size_t n = 0;
    if (text == NULL) return true;
    errno = 0;
    l->query.after_serial = strtoll(text, &end, 10);
    if (text[0] < '1' || text[0] > '9' || errno != 0) return refuse(r, "cursor", what, text);
    if (l->query.order == JOB_BY_CREATION) return *end == '\0' || refuse(r, "cursor", what, text);
    if (*end != '.' ||
        sodium_hex2bin((unsigned char *)l->key, sizeof l->key - 1, end + 1, strlen(end + 1), NULL, &n, NULL) != 0)
        return refuse(r, "cursor", what, text);
    l->key[n] = '\0';
    l->query.after_key = l->key;
    return true;
}

static void write_cursor(const struct job_query *q, const struct job_row *row, char out[CURSOR_BYTES])
{
    char key[STORE_KEY_BYTES];
    size_t n = (size_t)snprintf(out, CURSOR_BYTES, "%lld", (long long)row->serial);
    if (q->order == JOB_BY_CREATION) return;
    if (q->order == JOB_BY_END)
        snprintf(key, sizeof key, "%.17g", row->finished_unix_s);
    else
        snprintf(key, sizeof key, "%s", row->sample);
    out[n++] = '.';
    sodium_bin2hex(out + n, CURSOR_BYTES - n, (const unsigned char *)key, strlen(key));
}

static bool read_request(struct http_request *r, struct list_request *l)
{
    long long limit;
    struct job_query *q = &l->query;
    const char *view = given(r, "view");
    *l = (struct list_request){.have = given(r, "have")};
    if (view != NULL && strcmp(view, "row") != 0 && strcmp(view, "summary") != 0)
        return refuse(r, "view", "it must be summary or row", view);
    l->rows = view != NULL && view[0] == 'r';
    if (!query_integer(r, "limit", 1, LIST_MOST, LIST_USUAL, &limit) || !read_states(r, q) || !read_verdicts(r, l) ||
        !read_time(r, "created_after", &q->created_after_unix_s) ||
        !read_time(r, "created_before", &q->created_before_unix_s) || !read_order(r, q) || !read_cursor(r, l))
        return false;
    q->sample = given(r, "sample");
    q->id = given(r, "id");
    q->tag = given(r, "tag");
    q->batch = given(r, "batch");
    if (q->id != NULL && (strspn(q->id, "0123456789abcdef-") != strlen(q->id) || strlen(q->id) > 36))
        return refuse(r, "id", "it must be the beginning of an id", q->id);
    q->limit = (size_t)limit + 1; /* one more than asked for, to know whether there is another page */
    q->owner = r->grant.all ? NULL : r->grant.owner;
    return true;
}

static bool has(const char *list, const char *digest)
{
    return list != NULL && strstr(list, digest) != NULL; /* a digest has just so many hexadecimal digits */
}

/* Adds the rows to the list, and their digests to the tag. */
static status add_rows(struct http_request *r, const struct list_request *l, const struct job_row *row, size_t n,
                       crypto_generichash_state *tag, json_t *list, struct error *err)
{
    for (size_t i = 0; i < n; i++) {
        char digest[JOB_DIGEST_BYTES];
        json_t *view = job_row_view(r->service, &row[i], digest);
        if (view == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list the jobs: out of memory");
        crypto_generichash_update(tag, (const unsigned char *)row[i].id, strlen(row[i].id));
        crypto_generichash_update(tag, (const unsigned char *)digest, sizeof digest);
        if (has(l->have, digest)) {
            json_object_clear(view);
            json_object_set_new(view, "id", json_string(row[i].id));
            json_object_set_new(view, "digest", json_string(digest));
        }
        json_array_append_new(list, view);
    }
    return STATUS_OK;
}

static status add_summaries(struct http_request *r, const struct job_row *row, size_t n, json_t *list,
                            struct error *err)
{
    for (size_t i = 0; i < n; i++) {
        json_t *view = NULL;
        status s = job_view(r->service, &row[i], false, &view, err);
        if (s != STATUS_OK) return s;
        json_array_append_new(list, view);
    }
    return STATUS_OK;
}

/* The tag of rows does not depend on the rows that the client has. */
static void reply_rows(struct http_request *r, crypto_generichash_state *hash, const char *cursor, json_t *body)
{
    unsigned char sum[16];
    char tag[35];
    crypto_generichash_update(hash, (const unsigned char *)cursor, strlen(cursor));
    crypto_generichash_final(hash, sum, sizeof sum);
    tag[0] = '"';
    sodium_bin2hex(tag + 1, sizeof tag - 1, sum, sizeof sum);
    tag[33] = '"';
    tag[34] = '\0';
    if (reply_not_modified(r, tag)) {
        json_decref(body);
        return;
    }
    reply_json(r, MHD_HTTP_OK, body);
    reply_header(r, "ETag", tag);
}

static void list_jobs(struct http_request *r)
{
    struct list_request l;
    struct job_row *row = NULL;
    size_t n = 0;
    struct error err = {0};
    char cursor[CURSOR_BYTES] = "";
    crypto_generichash_state tag;
    if (!read_request(r, &l)) return;
    crypto_generichash_init(&tag, NULL, 0, 16);
    json_t *list = json_array();
    status s = store_job_list(r->service->store, &l.query, &row, &n, &err);
    if (s == STATUS_OK && n == l.query.limit) write_cursor(&l.query, &row[--n - 1], cursor);
    if (s == STATUS_OK) s = l.rows ? add_rows(r, &l, row, n, &tag, list, &err) : add_summaries(r, row, n, list, &err);
    job_rows_free(row, n);
    if (s != STATUS_OK) {
        json_decref(list);
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    json_t *body = json_pack("{s:o,s:o}", "jobs", list, "next_cursor", cursor[0] ? json_string(cursor) : json_null());
    if (l.rows)
        reply_rows(r, &tag, cursor, body);
    else
        reply_json_tagged(r, body);
}

void handle_list_jobs(struct http_request *r)
{
    struct long_poll poll;
    if (!long_poll_begin(r, NULL, &poll)) return;
    do {
        list_jobs(r);
    } while (long_poll_again(r, &poll));
}
