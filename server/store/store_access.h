/* Access tokens, sessions of browsers and the use of job owners, in the database of jobs. Only a hash of a token is
 * stored, and tokens are looked up by it: a text chosen by an attacker has no relation to the order of the index, so
 * the time of the look-up tells nothing. Rows of tokens are never removed: a revoked one stays, with its time. */
#ifndef SELVEDGE_SERVER_STORE_ACCESS_H
#define SELVEDGE_SERVER_STORE_ACCESS_H

#include "server/store/store.h"

enum { STORE_SECRET_HASH_BYTES = 32, QUOTA_DEFAULT = -1 };

/* The scopes of requests and tokens: each includes the scopes before it. */
enum access_scope { ACCESS_OPEN, ACCESS_READ, ACCESS_SUBMIT, ACCESS_ADMIN, ACCESS_N_SCOPE };
const char *access_scope_name(enum access_scope scope);
/* Returns false when no token can have such a scope. */
bool access_scope_parse(const char *name, enum access_scope *scope);

/* Quotas; 0: no limit, QUOTA_DEFAULT: the quota of the settings. */
struct access_quota {
    int64_t requests_per_minute, stored_bytes, jobs;
};

struct token_row {
    int64_t serial; /* assigned by the store */
    char id[STORE_ID_BYTES];
    char name[STORE_OWNER_BYTES];  /* no two tokens that are not revoked share one */
    char owner[STORE_OWNER_BYTES]; /* whose jobs it sees and makes; tokens may share an owner */
    enum access_scope scope;
    struct access_quota quota;
    unsigned char hash[STORE_SECRET_HASH_BYTES];
    double created_unix_s, used_unix_s, revoked_unix_s; /* 0: not yet */
};

/* Whether a token was ever made. */
status store_token_any(struct store *store, bool *any, struct error *err);
/* STATUS_EXISTS when a token of this name is not revoked. */
status store_token_insert(struct store *store, struct token_row *row, struct error *err);
/* By the hash of the token, or of a session that has not expired at now_unix_s. STATUS_NOT_FOUND when there is no such
 * token or it is revoked. */
status store_token_find(struct store *store, const unsigned char *hash, bool of_session, double now_unix_s,
                        struct token_row *row, struct error *err);
/* By its id, or by the name of one that is not revoked. STATUS_NOT_FOUND. */
status store_token_get(struct store *store, const char *id_or_name, struct token_row *row, struct error *err);
/* Revokes a token, which ends its sessions. An earlier revocation stays. STATUS_NOT_FOUND. */
status store_token_revoke(struct store *store, const char *id, double now_unix_s, struct error *err);
/* Writes the last uses of n tokens, in one transaction. */
status store_token_used(struct store *store, const struct token_row *row, size_t n, struct error *err);
/* The newest tokens before a serial (0: from the newest). The caller frees *row. */
status store_token_list(struct store *store, int64_t before_serial, size_t limit, struct token_row **row, size_t *n,
                        struct error *err);

/* Adds a session of a token, and removes those that have expired. */
status store_session_insert(struct store *store, const unsigned char *hash, const char *token_id, double now_unix_s,
                            double expires_unix_s, struct error *err);
/* For a database that was rebuilt: ends all sessions, and with `require` makes every request need a token, even if none
 * is known any more. */
status store_access_rebuilt(struct store *store, bool require, double now_unix_s, struct error *err);
/* Ends a session. STATUS_OK also when there is none. */
status store_session_erase(struct store *store, const unsigned char *hash, struct error *err);

/* The owner of a job that is not deleted, of a batch, or of the job of an upload. STATUS_NOT_FOUND. */
status store_job_owner(struct store *store, const char *job_id, char owner[STORE_OWNER_BYTES], struct error *err);
status store_batch_owner(struct store *store, const char *batch_id, char owner[STORE_OWNER_BYTES], struct error *err);
status store_upload_owner(struct store *store, const char *upload_id, char owner[STORE_OWNER_BYTES], struct error *err);
/* The number of jobs that an owner keeps, and the declared bytes of their files, without tombstones. */
struct owner_use {
    int64_t jobs, bytes;
};
status store_owner_use(struct store *store, const char *owner, struct owner_use *use, struct error *err);

#endif
