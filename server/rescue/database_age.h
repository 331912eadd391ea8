/* Whether the database is behind the folders of the jobs, as it is when its WAL was lost or an old copy was put back.
 * Every change that was acknowledged is in the database first and then in the journal of its job, so a sound database
 * is never older than a journal. */
#ifndef SELVEDGE_SERVER_DATABASE_AGE_H
#define SELVEDGE_SERVER_DATABASE_AGE_H

#include "server/settings/settings.h"
#include "server/store/store.h"

/* Compares the database, of any version, with the journals of all folders in DATA/jobs; daemons may be using both.
 * database: its path, or its address where store is open; store NULL: it is the file of this path.
 * STATUS_FORMAT, with the numbers and one job: it lacks jobs that were acknowledged, or has an older row of them than a
 * sealed record (journal_seal.h) of their journals. Journals that cannot be read are passed over. STATUS_NO_MEMORY. */
status database_age_check(const struct settings *settings, const char *database, struct store *store,
                          struct error *err);

#endif
