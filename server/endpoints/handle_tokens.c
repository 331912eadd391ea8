/* Access tokens: making, listing and revoking them. Only a token with scope admin may. */
#include "base/clock.h"
#include "server/access/access_secret.h"
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/http/http_reply.h"
#include "server/jobs/disk_reserve.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LIST_MOST = 500, LIST_USUAL = 50 };

static const struct {
    const char *name;
    size_t offset;
} quota_member[] = {{"requests_per_minute", offsetof(struct access_quota, requests_per_minute)},
                    {"stored_bytes", offsetof(struct access_quota, stored_bytes)},
                    {"jobs", offsetof(struct access_quota, jobs)}};
enum { N_QUOTA = sizeof quota_member / sizeof quota_member[0] };

static int64_t *quota_at(struct access_quota *q, size_t i)
{
    return (int64_t *)(void *)((char *)q + quota_member[i].offset);
}

static json_t *time_or_null(double t) { return t > 0 ? json_real(t) : json_null(); }

static json_t *view(struct token_row *t)
{
    json_t *out = json_pack("{s:s,s:s,s:s,s:s,s:f,s:o,s:o}", "id", t->id, "name", t->name, "owner", t->owner, "scope",
                            access_scope_name(t->scope), "created_unix_s", t->created_unix_s, "last_used_unix_s",
                            time_or_null(t->used_unix_s), "revoked_unix_s", time_or_null(t->revoked_unix_s));
    for (size_t i = 0; i < N_QUOTA; i++) {
        int64_t v = *quota_at(&t->quota, i);
        json_object_set_new(out, quota_member[i].name, v == QUOTA_DEFAULT ? json_null() : json_integer((json_int_t)v));
    }
    return out;
}

void handle_list_tokens(struct http_request *r)
{
    struct token_row *row = NULL;
    size_t n = 0;
    struct error err = {0};
    long long limit, cursor;
    char next[32] = "";
    if (!query_integer(r, "limit", 1, LIST_MOST, LIST_USUAL, &limit) ||
        !query_integer(r, "cursor", 1, INT64_MAX, 0, &cursor))
        return;
    if (store_token_list(r->service->store, cursor, (size_t)limit + 1, &row, &n, &err) != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    json_t *list = json_array();
    for (size_t i = 0; i < n && i < (size_t)limit; i++) json_array_append_new(list, view(&row[i]));
    if (n > (size_t)limit) snprintf(next, sizeof next, "%lld", (long long)row[limit - 1].serial);
    free(row);
    reply_json_tagged(r,
                      json_pack("{s:o,s:o}", "tokens", list, "next_cursor", next[0] ? json_string(next) : json_null()));
}

static status read_text(const json_t *value, const char *key, char out[STORE_OWNER_BYTES], struct error *err)
{
    if (!json_is_string(value) || json_string_length(value) >= STORE_OWNER_BYTES)
        return error_set_field(err, STATUS_INVALID, key, "member '%s' must be a text of at most %d characters", key,
                               STORE_OWNER_BYTES - 1);
    snprintf(out, STORE_OWNER_BYTES, "%s", json_string_value(value));
    return STATUS_OK;
}

static status read_member(const char *key, const json_t *value, struct token_row *t, struct error *err)
{
    if (strcmp(key, "name") == 0) return read_text(value, key, t->name, err);
    if (strcmp(key, "owner") == 0) return read_text(value, key, t->owner, err);
    if (strcmp(key, "scope") == 0) {
        if (json_is_string(value) && access_scope_parse(json_string_value(value), &t->scope)) return STATUS_OK;
        return error_set_field(err, STATUS_INVALID, key, "member 'scope' must be read, submit or admin");
    }
    for (size_t i = 0; i < N_QUOTA; i++) {
        if (strcmp(key, quota_member[i].name) != 0) continue;
        if (json_is_null(value)) return STATUS_OK;
        if (!json_is_integer(value) || json_integer_value(value) < 0)
            return error_set_field(err, STATUS_INVALID, key, "member '%s' must be a whole number from 0", key);
        *quota_at(&t->quota, i) = json_integer_value(value);
        return STATUS_OK;
    }
    return error_set_field(err, STATUS_INVALID, key,
                           "a token has no member '%.80s'; its members are name, owner, scope, requests_per_minute, "
                           "stored_bytes, jobs",
                           key);
}

static status read_token(const json_t *j, struct token_row *t, struct error *err)
{
    const char *key;
    json_t *value;
    status s =
        json_is_object(j) ? STATUS_OK : error_set(err, STATUS_INVALID, "a token is an object {name, scope, ...}");
    *t = (struct token_row){.quota = {QUOTA_DEFAULT, QUOTA_DEFAULT, QUOTA_DEFAULT}};
    json_object_foreach((json_t *)(uintptr_t)j, key, value)
    {
        if (s == STATUS_OK) s = read_member(key, value, t, err);
    }
    if (s == STATUS_OK && t->scope == ACCESS_OPEN)
        s = error_set_field(err, STATUS_INVALID, "scope", "member 'scope' is missing; it is read, submit or admin");
    return s;
}

/* While nobody needs a token, any user of this machine could make the first one and lock the others out. */
static bool tokens_are_in_use(struct http_request *r)
{
    if (r->grant.token_serial != 0) return true;
    reply_code(r, "conflict", "",
               "no token is needed yet; whoever owns the data folder makes the first one: selvedged --data DIR "
               "--make-token NAME");
    return false;
}

void handle_make_token(struct http_request *r)
{
    struct token_row token;
    struct error err = {0};
    char text[ACCESS_SECRET_TEXT_BYTES];
    if (!tokens_are_in_use(r)) return;
    json_t *j = request_json(r);
    if (j == NULL) return;
    status s = read_token(j, &token, &err);
    json_decref(j);
    if (s == STATUS_OK) s = access_token_make(r->service->store, &token, text, &err);
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    log_info(r->service->log, "token '%s' with scope %s was made by '%s'", token.name, access_scope_name(token.scope),
             r->grant.name);
    json_t *out = view(&token);
    json_object_set_new(out, "token", json_string(text));
    sodium_memzero(text, sizeof text);
    reply_json(r, MHD_HTTP_CREATED, out);
    reply_no_store(r);
}

void handle_revoke_token(struct http_request *r)
{
    struct token_row token;
    struct error err = {0};
    status s = store_token_get(r->service->store, r->param[0], &token, &err);
    if (s == STATUS_OK) s = store_token_revoke(r->service->store, token.id, clock_wall_s(), &err);
    for (int step = 0; s == STATUS_DISK_FULL && disk_reserve_make_room(r->service, &step);)
        s = store_token_revoke(r->service->store, token.id, clock_wall_s(), &err);
    if (s == STATUS_NOT_FOUND) error_set(&err, s, "token '%.80s' does not exist", r->param[0]);
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    log_info(r->service->log, "token '%s' was revoked by '%s'", token.name, r->grant.name);
    reply_empty(r, MHD_HTTP_NO_CONTENT);
}
