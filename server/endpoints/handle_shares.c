/* Links that show one job and its results to someone without an account: made, listed and revoked by whoever may change
 * the job, and exchanged for a cookie by whoever has the link. */
#include "base/clock.h"
#include "server/access/access_secret.h"
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/http/access_guard.h"
#include "server/http/http_listen.h"
#include "server/http/http_reply.h"
#include "server/http/http_tls.h"
#include "server/store/store_share.h"

#include <math.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <uuid/uuid.h>

enum { MOST_SHARES = 200, USUAL_DAYS = 30, MOST_DAYS = 3650 };
static const double day_s = 86400.0;

static json_t *view(const struct share_row *row, double now_s)
{
    return json_pack("{s:s, s:s, s:f, s:f, s:o, s:b}", "id", row->id, "made_by", row->made_by, "created_unix_s",
                     row->created_unix_s, "expires_unix_s", row->expires_unix_s, "revoked_unix_s",
                     row->revoked_unix_s > 0.0 ? json_real(row->revoked_unix_s) : json_null(), "open",
                     row->revoked_unix_s == 0.0 && row->expires_unix_s > now_s);
}

/* Reads {"days": n}, which may be left out. */
static status read_days(const json_t *body, double *days, struct error *err)
{
    const char *key;
    json_t *value;
    *days = USUAL_DAYS;
    if (!json_is_object(body))
        return error_set(err, STATUS_INVALID, "the body must be an object, such as {\"days\": 7}");
    json_object_foreach((json_t *)body, key, value)
    {
        if (strcmp(key, "days") != 0)
            return error_set_field(err, STATUS_INVALID, key, "a link has no member '%.60s'; its member is days", key);
        *days = json_is_number(value) ? json_number_value(value) : NAN;
        if (!(*days >= 0.01 && *days <= MOST_DAYS))
            return error_set_field(err, STATUS_INVALID, "days", "member 'days' must be a number from 0.01 to %d",
                                   (int)MOST_DAYS);
    }
    return STATUS_OK;
}

void handle_make_share(struct http_request *r)
{
    char text[ACCESS_SECRET_TEXT_BYTES];
    struct share_row row = {.created_unix_s = clock_wall_s()};
    struct error err = {0};
    struct job_row job;
    double days;
    uuid_t u;
    json_t *body = request_json(r);
    if (body == NULL) return;
    status s = read_days(body, &days, &err);
    json_decref(body);
    if (s == STATUS_OK) s = job_look(r->service, r->param[0], &job, &err);
    if (s == STATUS_OK) {
        uuid_generate_random(u);
        uuid_unparse_lower(u, row.id);
        snprintf(row.job_id, sizeof row.job_id, "%s", r->param[0]);
        snprintf(row.made_by, sizeof row.made_by, "%s", r->grant.name);
        row.expires_unix_s = row.created_unix_s + days * day_s;
        access_secret_new(text, row.hash);
        s = store_share_insert(r->service->store, &row, &err);
    }
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    log_info(r->service->log, "job %s: a link that ends in %.4g days was made by '%s'", row.job_id, days, row.made_by);
    json_t *out = view(&row, row.created_unix_s);
    json_object_set_new(out, "secret", json_string(text));
    json_object_set_new(out, "protected", json_boolean(r->grant.token_serial != 0));
    sodium_memzero(text, sizeof text);
    reply_json(r, MHD_HTTP_CREATED, out);
    reply_no_store(r);
}

void handle_list_shares(struct http_request *r)
{
    struct share_row *row = NULL;
    size_t n = 0;
    struct error err = {0};
    if (store_share_list(r->service->store, r->param[0], MOST_SHARES, &row, &n, &err) != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    json_t *list = json_array();
    for (size_t i = 0; i < n; i++) json_array_append_new(list, view(&row[i], clock_wall_s()));
    free(row);
    reply_json(r, MHD_HTTP_OK, json_pack("{s:o}", "shares", list));
}

void handle_revoke_share(struct http_request *r)
{
    struct error err = {0};
    if (store_share_revoke(r->service->store, r->param[0], r->param[1], clock_wall_s(), &err) != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    log_info(r->service->log, "job %s: a link was revoked by '%s'", r->param[0], r->grant.name);
    reply_empty(r, MHD_HTTP_NO_CONTENT);
}

/* The cookie is sent with requests about this job alone, so a session of the same browser stays as it is. */
static void reply_cookie(struct http_request *r, const struct share_row *row, const char *secret, double now_s)
{
    char text[300];
    const struct settings *s = r->service->settings;
    const bool secure = http_tls_wanted(s) || http_host_public(s, request_header(r, "Host"));
    snprintf(text, sizeof text, ACCESS_SHARE_COOKIE "=%s; Path=/v1/jobs/%s; Max-Age=%.0f; HttpOnly; SameSite=Strict%s",
             secret, row->job_id, floor(row->expires_unix_s - now_s), secure ? "; Secure" : "");
    reply_header(r, "Set-Cookie", text);
}

void handle_open_share(struct http_request *r)
{
    unsigned char hash[STORE_SECRET_HASH_BYTES];
    struct share_row row;
    struct error err = {0};
    const double now_s = clock_wall_s();
    json_t *body = request_json(r);
    if (body == NULL) return;
    const char *secret = json_string_value(json_object_get(body, "secret"));
    status s = secret == NULL || json_object_size(body) != 1 || strlen(secret) >= ACCESS_SECRET_TEXT_BYTES
                   ? error_set_field(&err, STATUS_INVALID, "secret", "the body must be {\"secret\": SECRET} of a link")
                   : STATUS_OK;
    if (s == STATUS_OK) {
        access_secret_hash(secret, hash);
        s = store_share_find(r->service->store, hash, now_s, &row, &err);
    }
    if (s != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else {
        reply_json(r, MHD_HTTP_OK, json_pack("{s:s, s:f}", "job", row.job_id, "expires_unix_s", row.expires_unix_s));
        reply_cookie(r, &row, secret, now_s);
        reply_no_store(r);
    }
    json_decref(body);
}
