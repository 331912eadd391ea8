/* Who asks, and the session of a browser: a cookie that no script can read, in place of a token that a page would
 * keep. */
#include "base/clock.h"
#include "server/access/access_secret.h"
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/http/access_guard.h"
#include "server/http/http_listen.h"
#include "server/http/http_reply.h"
#include "server/http/http_tls.h"

#include <stdio.h>
#include <string.h>

static void reply_grant(struct http_request *r, const struct access_grant *g)
{
    struct owner_use use = {0};
    struct error err = {0};
    bool anyone = g->token_serial == 0;
    status s = store_owner_use(r->service->store, g->owner, &use, &err);
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    json_t *quota = json_pack("{s:I,s:I,s:I}", "requests_per_minute", (json_int_t)g->quota.requests_per_minute,
                              "stored_bytes", (json_int_t)g->quota.stored_bytes, "jobs", (json_int_t)g->quota.jobs);
    json_t *used = json_pack("{s:I,s:I}", "stored_bytes", (json_int_t)use.bytes, "jobs", (json_int_t)use.jobs);
    reply_json(r, MHD_HTTP_OK,
               json_pack("{s:b,s:o,s:o,s:s,s:o,s:o}", "token_needed", !anyone, "name",
                         anyone ? json_null() : json_string(g->name), "owner",
                         anyone ? json_null() : json_string(g->owner), "scope", access_scope_name(g->scope), "quota",
                         quota, "used", used));
    reply_no_store(r);
}

void handle_get_session(struct http_request *r) { reply_grant(r, &r->grant); }

/* Sets the cookie. It is sent over https only where the browser came by https. */
static void reply_cookie(struct http_request *r, const char *value, long long age_s)
{
    char text[256];
    const struct settings *s = r->service->settings;
    bool secure = http_tls_wanted(s) || http_host_public(s, request_header(r, "Host"));
    snprintf(text, sizeof text, ACCESS_COOKIE "=%s; Path=/; Max-Age=%lld; HttpOnly; SameSite=Strict%s", value, age_s,
             secure ? "; Secure" : "");
    reply_header(r, "Set-Cookie", text);
}

void handle_sign_in(struct http_request *r)
{
    char secret[ACCESS_SECRET_TEXT_BYTES];
    unsigned char hash[STORE_SECRET_HASH_BYTES];
    struct access_grant grant;
    struct error err = {0};
    json_t *j = request_json(r);
    if (j == NULL) return;
    const char *token = json_string_value(json_object_get(j, "token"));
    double now_s = clock_wall_s();
    const int64_t age_s = r->service->settings->session_s;
    status s = token == NULL || json_object_size(j) != 1
                   ? error_set_field(&err, STATUS_INVALID, "token", "the body must be {\"token\": TOKEN}")
                   : access_find(r->registry, token, false, &grant, &err);
    json_decref(j);
    if (s == STATUS_OK) {
        access_secret_new(secret, hash);
        s = store_session_insert(r->service->store, hash, grant.token_id, now_s, now_s + (double)age_s, &err);
    }
    if (s == STATUS_NOT_FOUND) {
        reply_code(r, "token", "token", "the access token is unknown or was revoked");
        reply_header(r, "WWW-Authenticate", "Bearer realm=\"selvedge\", error=\"invalid_token\"");
    } else if (s != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else {
        reply_grant(r, &grant);
        reply_cookie(r, secret, (long long)age_s);
    }
}

void handle_sign_out(struct http_request *r)
{
    unsigned char hash[STORE_SECRET_HASH_BYTES];
    struct error err = {0};
    const char *secret = MHD_lookup_connection_value(r->connection, MHD_COOKIE_KIND, ACCESS_COOKIE);
    status s = STATUS_OK;
    if (secret != NULL) {
        access_secret_hash(secret, hash);
        s = store_session_erase(r->service->store, hash, &err);
    }
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    reply_empty(r, MHD_HTTP_NO_CONTENT);
    reply_cookie(r, "", 0);
}
