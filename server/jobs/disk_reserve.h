/* Reserved disk space: a file in the data folder, DATA/ballast, whose size is the setting disk.ballast_bytes. On
 * a completely full disk neither a start nor a deletion could be recorded. The file is then removed, so that they
 * succeed, and made again when there is space. */
#ifndef SELVEDGE_SERVER_DISK_RESERVE_H
#define SELVEDGE_SERVER_DISK_RESERVE_H

#include <stdbool.h>
#include <stdint.h>

struct job_service;
struct settings;

/* Makes the file, or enlarges it up to disk.ballast_bytes, or 1 MiB if that is more, with at most half of the space
 * above the floor, so that it keeps no job from running; under the floor the file is small. all: a small file may take
 * all free space, as at the start and at the end of a daemon. */
void disk_reserve_keep(const struct settings *settings, bool all);
/* Returns false if there was no file to remove. */
bool disk_reserve_release(const char *data_folder);

/* Makes room for a change that has found the disk full and that frees space or ends work: first within the database
 * file, then by removing the reserve file. To be repeated, with *step 0 at first, while the change finds the disk full;
 * returns false when nothing more can be done. */
bool disk_reserve_make_room(struct job_service *v, int *step);

#endif
