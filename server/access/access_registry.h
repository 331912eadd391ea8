/* Who asks: finds the token of a secret, counts its requests against its quota, and remembers when it was last used.
 * Whether tokens are required, and which are valid, is read from the database each time, so a token that was made or
 * revoked, by this process or another one, counts from the next request on. All functions are thread-safe. */
#ifndef SELVEDGE_SERVER_ACCESS_REGISTRY_H
#define SELVEDGE_SERVER_ACCESS_REGISTRY_H

#include "server/settings/settings.h"
#include "server/store/store_access.h"

/* The rights of a request. */
struct access_grant {
    enum access_scope scope;
    bool all;                      /* sees the jobs of all owners */
    int64_t token_serial;          /* 0: no token was needed */
    char token_id[STORE_ID_BYTES]; /* "": none */
    char name[STORE_OWNER_BYTES], owner[STORE_OWNER_BYTES];
    struct access_quota quota; /* in effect; 0: no limit */
    char job[STORE_ID_BYTES];  /* of a link that shows this job alone; "": a token's, or everyone's */
};

struct access_registry;

/* STATUS_NO_MEMORY. */
status access_registry_new(struct store *store, const struct settings *settings, struct access_registry **registry,
                           struct error *err);
/* Writes the last uses that are not stored yet. NULL is accepted. */
void access_registry_free(struct access_registry *registry);

/* Whether a token is needed: from the first one on that was ever made, or always by access.required. */
status access_required(struct access_registry *registry, bool *required, struct error *err);
/* The grant when no token is needed. */
struct access_grant access_grant_of_everyone(void);
/* The grant of a token, or of a session. STATUS_NOT_FOUND when it is unknown, revoked or has ended. */
status access_find(struct access_registry *registry, const char *secret, bool is_session, struct access_grant *grant,
                   struct error *err);
/* The grant of a link's secret: it reads one job. STATUS_NOT_FOUND when the link is unknown, revoked or has ended. */
status access_find_share(struct access_registry *registry, const char *secret, struct access_grant *grant,
                         struct error *err);
/* Counts a request at the monotonic time now_s. Returns 0, or after how many seconds (at least 1) it may be tried
 * again, when the quota of requests is used up. A token may use up the requests of a minute at once. */
long long access_count(struct access_registry *registry, const struct access_grant *grant, double now_s);
/* Writes the times of last use, if they are due. To be called about once a second. */
void access_registry_flush(struct access_registry *registry, bool now);

#endif
