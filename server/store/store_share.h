/* Links that show one job to whoever has them, in the database of jobs. Only a hash of a link's secret is stored. A
 * link ends at its time, when it is revoked, and with its job. */
#ifndef SELVEDGE_SERVER_STORE_SHARE_H
#define SELVEDGE_SERVER_STORE_SHARE_H

#include "server/store/store_access.h"

struct share_row {
    int64_t serial; /* assigned by the store */
    char id[STORE_ID_BYTES], job_id[STORE_ID_BYTES];
    char made_by[STORE_OWNER_BYTES]; /* name of the token; "" where no token was needed */
    unsigned char hash[STORE_SECRET_HASH_BYTES];
    double created_unix_s, expires_unix_s, revoked_unix_s; /* revoked 0: not yet */
};

status store_share_insert(struct store *store, struct share_row *row, struct error *err);
/* The link with this hash that counts at now_unix_s, of a job that is not deleted. STATUS_NOT_FOUND. */
status store_share_find(struct store *store, const unsigned char *hash, double now_unix_s, struct share_row *row,
                        struct error *err);
/* The newest links of a job, ended ones too, at most `most`. The caller frees *row. */
status store_share_list(struct store *store, const char *job_id, size_t most, struct share_row **row, size_t *n,
                        struct error *err);
/* Ends a link of a job. An earlier revocation stays. STATUS_NOT_FOUND. */
status store_share_revoke(struct store *store, const char *job_id, const char *id, double now_unix_s,
                          struct error *err);

#endif
