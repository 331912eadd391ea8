/* Files that survive kill -9 and power loss, and append-only record files that notice a torn tail. */
#ifndef SELVEDGE_BASE_DURABLE_H
#define SELVEDGE_BASE_DURABLE_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Replace path as a whole: temporary file beside it, write, fsync, rename, fsync of the folder.
 * A reader sees the old content or the new, never a mixture. On failure the old file is untouched. */
status durable_replace(const char *path, const void *data, size_t n_bytes, struct error *err);
/* The same without fsync: atomic against readers and kill -9, not against power loss (heartbeats). */
status durable_replace_volatile(const char *path, const void *data, size_t n_bytes, struct error *err);
/* fsync the folder that holds path (after creating, renaming or unlinking an entry). */
status durable_sync_folder_of(const char *path, struct error *err);
/* mkdir -p with mode 0700; existing folders are fine. */
status durable_make_folder(const char *path, struct error *err);

/* Whole file into memory, NUL-terminated behind n_bytes; free() it. STATUS_TOO_LARGE beyond limit_bytes. */
status file_read_all(const char *path, size_t limit_bytes, char **data, size_t *n_bytes, struct error *err);

/* Record file: lines "crc32hex json\n". The checksum is zlib's crc32 of the json text. */
status record_append(const char *path, const char *json, bool sync, struct error *err);

/* Calls visit for each whole, valid record from byte offset `from` on (0, or a value returned before).
 * A torn or damaged record ends the reading: *next is the offset behind the last good one. visit returns false to stop. */
typedef bool (*record_visitor)(void *context, const char *json, size_t n_json);
status record_read(const char *path, uint64_t from, record_visitor visit, void *context, uint64_t *next,
                   struct error *err);
/* Cut a torn tail (and everything behind offset keep_bytes, if keep_bytes < file size). */
status record_truncate(const char *path, uint64_t keep_bytes, struct error *err);

#endif
