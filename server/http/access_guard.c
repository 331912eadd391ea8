#include "server/http/access_guard.h"
#include "base/clock.h"
#include "server/http/http_reply.h"
#include "server/settings/job_paths.h"

#include <string.h>

/* The secret of a request: a bearer token, else the cookie of a session. NULL: there is none. A header of another kind
 * is no secret of ours, and does not let a cookie speak for it. */
static const char *secret_of(const struct http_request *r, bool *is_session)
{
    static const char bearer[] = "Bearer ";
    const char *header = request_header(r, "Authorization");
    *is_session = header == NULL;
    if (header == NULL) return MHD_lookup_connection_value(r->connection, MHD_COOKIE_KIND, ACCESS_COOKIE);
    if (strncasecmp(header, bearer, sizeof bearer - 1) != 0) return NULL;
    header += sizeof bearer - 1;
    return header + strspn(header, " ");
}

/* The requests that a link allows: those that read its job and the results of it. */
static bool is_shared(const struct http_route *route)
{
    static const char *const path[] = {"/v1/jobs/{id}", "/v1/jobs/{id}/results", "/v1/jobs/{id}/results/{path...}",
                                       "/v1/jobs/{id}/results.tar"};
    for (size_t i = 0; i < sizeof path / sizeof *path; i++)
        if (strcmp(route->method, "GET") == 0 && strcmp(route->path, path[i]) == 0) return true;
    return false;
}

/* Finds the grant of a link to the job of the request: its secret is a bearer token, or the cookie of links. */
static bool find_share(struct http_request *r, struct access_grant *grant)
{
    bool is_session;
    const char *secret = secret_of(r, &is_session);
    if (is_session) secret = MHD_lookup_connection_value(r->connection, MHD_COOKIE_KIND, ACCESS_SHARE_COOKIE);
    return secret != NULL && is_shared(r->route) && access_find_share(r->registry, secret, grant, NULL) == STATUS_OK &&
           strcmp(grant->job, r->param[0]) == 0;
}

static void refuse(struct http_request *r, const char *challenge, const char *detail)
{
    reply_code(r, "token", "Authorization", detail);
    reply_header(r, "WWW-Authenticate", challenge);
}

/* Finds the grant of a request that needs a token. */
static bool find_grant(struct http_request *r, struct access_grant *grant)
{
    struct error err = {0};
    bool is_session;
    const char *secret = secret_of(r, &is_session);
    if (secret == NULL) {
        refuse(r, "Bearer realm=\"selvedge\"",
               "this service needs an access token: send it as 'Authorization: Bearer TOKEN', or sign in at the "
               "dashboard");
        return false;
    }
    status s = access_find(r->registry, secret, is_session, grant, &err);
    if (s == STATUS_NOT_FOUND)
        refuse(r, "Bearer realm=\"selvedge\", error=\"invalid_token\"",
               is_session ? "the session has ended; sign in again" : "the access token is unknown or was revoked");
    else if (s != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    return s == STATUS_OK;
}

static bool within_rate(struct http_request *r)
{
    long long wait_s = access_count(r->registry, &r->grant, clock_monotonic_s());
    if (wait_s == 0) return true;
    struct error err = {0};
    json_int_t most = (json_int_t)r->grant.quota.requests_per_minute;
    error_set(&err, STATUS_TOO_LARGE, "token '%s' may make %lld requests a minute; try again in %lld s", r->grant.name,
              (long long)most, wait_s);
    reply_problem(r, "rate", &err, json_pack("{s:I,s:I}", "requests_per_minute", most, "retry_after_s", wait_s));
    reply_header_int(r, "Retry-After", wait_s);
    return false;
}

static bool within_scope(struct http_request *r)
{
    struct error err = {0};
    if (r->grant.scope >= r->route->need) return true;
    error_set(&err, STATUS_CONFLICT, "this needs a token with scope %s; '%s' has scope %s",
              access_scope_name(r->route->need), r->grant.name, access_scope_name(r->grant.scope));
    reply_problem(r, "scope", &err, json_pack("{s:s}", "scope", access_scope_name(r->route->need)));
    return false;
}

static bool is_own(struct http_request *r)
{
    char owner[STORE_OWNER_BYTES] = "";
    struct error err = {0};
    const bool job = strstr(r->route->path, "{id}") != NULL, upload = strstr(r->route->path, "{upload}") != NULL,
               batch = strstr(r->route->path, "{batch}") != NULL;
    if (r->grant.all || (!job && !upload && !batch)) return true;
    status s = !id_valid(r->param[0]) ? STATUS_NOT_FOUND
               : batch                ? store_batch_owner(r->service->store, r->param[0], owner, &err)
               : job                  ? store_job_owner(r->service->store, r->param[0], owner, &err)
                                      : store_upload_owner(r->service->store, r->param[0], owner, &err);
    if (s == STATUS_OK && strcmp(owner, r->grant.owner) == 0) return true;
    if (s == STATUS_OK || s == STATUS_NOT_FOUND)
        error_set(&err, STATUS_NOT_FOUND, "%s '%.40s' does not exist",
                  job     ? "job"
                  : batch ? "batch"
                          : "upload",
                  r->param[0]);
    reply_problem(r, NULL, &err, NULL);
    return false;
}

bool guard_access(struct http_request *r)
{
    struct error err = {0};
    bool required;
    r->grant = access_grant_of_everyone();
    if (r->route->need == ACCESS_OPEN) {
        r->grant = (struct access_grant){.scope = ACCESS_OPEN};
        return true;
    }
    if (access_required(r->registry, &required, &err) != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return false;
    }
    if (!required) return true;
    if (find_share(r, &r->grant)) return true;
    r->grant = (struct access_grant){.scope = ACCESS_OPEN};
    return find_grant(r, &r->grant) && within_rate(r) && within_scope(r) && is_own(r);
}

bool guard_access_still(struct http_request *r)
{
    struct access_grant now;
    if (r->grant.job[0] != '\0' && find_share(r, &now)) return true;
    if (r->grant.job[0] != '\0') {
        refuse(r, "Bearer realm=\"selvedge\"", "the link has ended or was revoked");
        return false;
    }
    return r->grant.token_serial == 0 || find_grant(r, &now);
}
