/* The folder of backups: files named selvedge-20261124T041500Z.db by the time (UTC) of their making, each examined
 * before it got its name (server/store/drivers/store_backup.h). */
#ifndef SELVEDGE_SERVER_BACKUP_FILES_H
#define SELVEDGE_SERVER_BACKUP_FILES_H

#include "server/settings/job_paths.h"
#include "server/settings/settings.h"

#include <stdint.h>

struct backup_file {
    char name[40];
    int64_t made_unix_s;
};

/* The folder that the settings name; by default backup/ in the data folder. */
void backup_folder(const struct settings *settings, char out[PATH_BYTES]);
/* The path of a backup that is made at this time. */
void backup_path(const char *folder, int64_t made_unix_s, char out[PATH_BYTES]);
/* Lists the backups, newest first; the caller frees *file. No folder: no backups. STATUS_IO, STATUS_NO_MEMORY. */
status backup_list(const char *folder, struct backup_file **file, size_t *n, struct error *err);
/* Which backups of a list (newest first) to keep: the newest `keep`, and of the older ones the newest of each day (UTC)
 * until `days` days have one. kept[n] is set. */
void backup_choose(const struct backup_file *file, size_t n, int64_t keep, int64_t days, bool *kept);
/* Removes the backups beyond the limits of the settings, and unfinished ones. No backup must be under way. */
status backup_prune(const char *folder, int64_t keep, int64_t days, struct error *err);

#endif
