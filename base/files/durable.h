/* Writes files so that they survive kill -9 and power loss, and keeps append-only record files whose incomplete last
 * record is detected by a checksum. */
#ifndef SELVEDGE_BASE_DURABLE_H
#define SELVEDGE_BASE_DURABLE_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Replaces the whole file at path: writes a temporary file beside it, fsyncs it, renames it and fsyncs the folder. A
 * reader sees either the old or the new content, never a mixture. On failure the old file is untouched, except when
 * only the last step, the fsync of the folder, failed. STATUS_IO, STATUS_DISK_FULL, STATUS_NOT_FOUND (no such
 * folder), STATUS_INVALID (path over 4 kB). */
status durable_replace(const char *path, const void *data, size_t n_bytes, struct error *err);
/* The same without fsync: the replacement survives kill -9 but not power loss. Used for heartbeats. */
status durable_replace_volatile(const char *path, const void *data, size_t n_bytes, struct error *err);
/* Fsyncs the folder that holds path, as is needed after an entry was created, renamed or removed. STATUS_INVALID for
 * paths over 4 kB, STATUS_IO. */
status durable_sync_folder_of(const char *path, struct error *err);
/* Gives a file that is already written and closed its final name: fsyncs the file, renames it and fsyncs the folder.
 * On failure `temporary` is removed. STATUS_IO, STATUS_DISK_FULL. */
status durable_rename(const char *temporary, const char *path, struct error *err);
/* Makes a folder and its missing parents with mode 0700; existing folders are accepted. New folders are not synced;
 * call durable_sync_folder_of for that. STATUS_EXISTS when a file has that name, STATUS_INVALID for "" and for paths
 * over 4 kB, STATUS_IO. */
status durable_make_folder(const char *path, struct error *err);

/* Reads a whole file into memory; the caller frees *data. A NUL follows the *n_bytes bytes (n_bytes may be NULL).
 * STATUS_TOO_LARGE beyond limit_bytes, STATUS_INVALID when path is not a regular file, STATUS_NOT_FOUND, STATUS_IO,
 * STATUS_NO_MEMORY. */
status file_read_all(const char *path, size_t limit_bytes, char **data, size_t *n_bytes, struct error *err);

/* Returns the last component of a path, or the whole path if it ends in a slash. Error messages use it so that they
 * name files as the user knows them. */
const char *path_file_name(const char *path);

/* Appends a record "crc32hex json\n" to a file; the checksum is zlib's crc32 of json. json must be a single line of
 * at least one character (STATUS_INVALID). With `sync` the record survives power loss, and so does the file if this
 * is its first record. On failure the file is unchanged or ends in an incomplete record, which readers ignore. A link
 * at path is not followed.
 * STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY. */
status record_append(const char *path, const char *json, bool sync, struct error *err);

/* Bytes of the longest line. A longer one is damaged for readers, and is not appended. */
enum { RECORD_MOST_BYTES = 8 << 20 };

/* Calls visit for each valid record from byte offset `from` on (0, or a value returned in *next). Reading ends at
 * the first incomplete or damaged record; *next (may be NULL) is then the offset after the last valid record. visit
 * returns false to stop. Its json is NUL-terminated, and visit may change it, until it returns. STATUS_NOT_FOUND (also
 * of a link, a pipe and the like), STATUS_IO, STATUS_NO_MEMORY. */
typedef bool (*record_visitor)(void *context, const char *json, size_t n_json);
status record_read(const char *path, uint64_t from, record_visitor visit, void *context, uint64_t *next,
                   struct error *err);
/* Finds an offset from which to read a sorted file, without reading all of it. `before` must hold for the records up
 * to some point of the file and for none after it. *from becomes the offset of a record for which `before` holds, or
 * 0, such that little more than 64 KiB of further such records follow. STATUS_NOT_FOUND, STATUS_IO,
 * STATUS_NO_MEMORY. */
status record_seek(const char *path, record_visitor before, void *context, uint64_t *from, struct error *err);
/* Removes an incomplete last record: truncates the file to keep_bytes if it is longer. A missing file is not an
 * error. STATUS_IO. */
status record_truncate(const char *path, uint64_t keep_bytes, struct error *err);

#endif
