/* Files that survive kill -9 and power loss, and append-only record files that notice a torn tail. */
#ifndef SELVEDGE_BASE_DURABLE_H
#define SELVEDGE_BASE_DURABLE_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Replace path as a whole: temporary file beside it, write, fsync, rename, fsync of the folder.
 * A reader sees the old content or the new, never a mixture. On failure the old file is untouched (but where only the folder could
 * not be synced, which comes last). STATUS_IO, STATUS_DISK_FULL, STATUS_NOT_FOUND (no such folder), STATUS_INVALID (path over 4 kB). */
status durable_replace(const char *path, const void *data, size_t n_bytes, struct error *err);
/* The same without fsync: atomic against readers and kill -9, not against power loss (heartbeats). */
status durable_replace_volatile(const char *path, const void *data, size_t n_bytes, struct error *err);
/* fsync the folder that holds path (after creating, renaming or unlinking an entry). STATUS_INVALID for paths over 4 kB, STATUS_IO. */
status durable_sync_folder_of(const char *path, struct error *err);
/* A file that somebody has written and closed, to its final name: its bytes, then the name, then the folder are on disk. On failure
 * `temporary` is removed. STATUS_IO, STATUS_DISK_FULL. */
status durable_rename(const char *temporary, const char *path, struct error *err);
/* mkdir -p with mode 0700; existing folders are fine. STATUS_EXISTS when something else has the name, STATUS_INVALID for "" and paths over
 * 4 kB, STATUS_IO. New folders are not synced: durable_sync_folder_of does that. */
status durable_make_folder(const char *path, struct error *err);

/* Whole file into memory, NUL-terminated behind *n_bytes (n_bytes may be NULL); free() it. STATUS_TOO_LARGE beyond limit_bytes,
 * STATUS_INVALID for what is not a regular file, STATUS_NOT_FOUND, STATUS_IO, STATUS_NO_MEMORY. */
status file_read_all(const char *path, size_t limit_bytes, char **data, size_t *n_bytes, struct error *err);

/* Last component of a path, for errors that name files as the user knows them; all of it when it ends in a slash. */
const char *path_file_name(const char *path);

/* Record file: lines "crc32hex json\n". The checksum is zlib's crc32 of the json text, which is one line of at least one character
 * (STATUS_INVALID). sync: the record survives power loss, and so does a file that it is the first of. On failure the file is as it was,
 * or has a torn tail. STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY. */
status record_append(const char *path, const char *json, bool sync, struct error *err);

/* Calls visit for each whole, valid record from byte offset `from` on (0, or a value returned before).
 * A torn or damaged record ends the reading: *next (may be NULL) is the offset behind the last good one. visit returns false to stop; json is
 * NUL-terminated and its own until then. STATUS_NOT_FOUND, STATUS_IO. */
typedef bool (*record_visitor)(void *context, const char *json, size_t n_json);
status record_read(const char *path, uint64_t from, record_visitor visit, void *context, uint64_t *next,
                   struct error *err);
/* Finds a place to begin reading in a file whose records are in order (`before` holds for those up to a place, and for
 * none behind it) without reading it all: *from is the offset of a record for which it holds, or 0, and not much more
 * than 64 KiB of further such records follow. */
status record_seek(const char *path, record_visitor before, void *context, uint64_t *from, struct error *err);
/* Cut a torn tail: everything behind offset keep_bytes, if keep_bytes < file size. A file that does not exist is fine. STATUS_IO. */
status record_truncate(const char *path, uint64_t keep_bytes, struct error *err);

#endif
