/* Backs up the database every backup.every_s seconds, on a thread and a connection of its own, and removes old backups.
 * The first backup of a start is made a minute after it at the earliest. */
#ifndef SELVEDGE_SERVER_BACKUP_KEEPER_H
#define SELVEDGE_SERVER_BACKUP_KEEPER_H

#include "server/jobs/job_service.h"

struct backup_keeper;

/* *keeper is NULL when the settings say that there are no backups. service->backup is set. STATUS_NO_MEMORY,
 * STATUS_IO. */
status backup_keeper_start(struct job_service *service, struct backup_keeper **keeper, struct error *err);
/* Waits for a backup that is being made. */
void backup_keeper_stop(struct backup_keeper *keeper);

struct backup_state {
    int64_t last_good_unix_s, last_good_bytes; /* 0: none yet; a backup from before the start counts, too */
    uint64_t n_good, n_failed;                 /* since the start */
    char error[640];                           /* of the last one; "": it is good */
};
/* keeper NULL: zeros. */
void backup_keeper_state(struct backup_keeper *keeper, struct backup_state *state);

#endif
