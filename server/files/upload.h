/* Uploads of input files. An upload that a connection works on is in memory once. Its writer has a ticket; a second
 * PATCH or a HEAD takes the upload over, which makes older tickets stale. The SHA-256 is computed as the bytes
 * arrive and stored in the database with the offset, so a file of any size needs constant memory and is never read
 * again. The bytes are in JOB/upload/<id>, whose space is reserved at the declaration; the complete and verified
 * file is renamed to JOB/input/<name>. */
#ifndef SELVEDGE_SERVER_UPLOAD_H
#define SELVEDGE_SERVER_UPLOAD_H

#include "base/log.h"
#include "server/store/store.h"

#include <stdatomic.h>

struct upload_set;
struct upload;

status upload_set_new(struct store *store, const char *data_folder, int64_t commit_bytes, struct log *log,
                      struct upload_set **set, struct error *err);
void upload_set_free(struct upload_set *set);

/* Removes the bytes of a file, complete or not, and ends its writers, without waiting for their syncs. The caller
 * removes the row first. */
void upload_discard(struct upload_set *set, const struct file_row *row);
/* Ends the writers of all files of a job. */
void upload_discard_job(struct upload_set *set, const char *job_id);

/* Finds an upload and keeps it in memory until upload_release. STATUS_NOT_FOUND, STATUS_NO_MEMORY. */
status upload_hold(struct upload_set *set, const char *id, struct upload **upload, struct error *err);
void upload_release(struct upload_set *set, struct upload *upload);

/* Makes the caller the only writer. First commits the bytes of earlier writers, and completes an upload that has all
 * its bytes. *row is the present state. */
status upload_take(struct upload *upload, uint64_t *ticket, struct file_row *row, struct error *err);
/* Writes bytes and advances the offset. STATUS_STALE when another writer has taken over, STATUS_INVALID (more bytes
 * than declared), STATUS_DISK_FULL, STATUS_IO. */
status upload_write(struct upload *upload, uint64_t ticket, const void *data, size_t n_bytes, struct error *err);
/* Writes the received bytes to disk durably. A file that has all its bytes is verified and moved to its place. *row
 * (may be NULL) is the state afterwards. STATUS_CHECKSUM: the checksum differs, and the upload is back at offset 0. */
status upload_commit(struct upload *upload, uint64_t ticket, struct file_row *row, struct error *err);

/* Sets the checksum of an upload that was declared without one; it is compared at the end of the upload. *row is the
 * present state. STATUS_EXISTS if the file already has another checksum, declared or computed. */
status upload_set_checksum(struct upload_set *set, const char *id, const char *sha256, struct file_row *row,
                           struct error *err);

/* At the start of the daemon: completes files that were verified but not moved, and restarts uploads whose bytes are
 * missing. */
status upload_recover(struct upload_set *set, struct error *err);

/* Updates a row from the database to the present offset, without taking the upload over. */
void upload_refresh(struct upload_set *set, struct file_row *row);
/* A number that differs, but for a chance of 2^-64, when an upload of the job that a connection works on has got
 * further. */
uint64_t upload_progress(struct upload_set *set, const char *job_id);
uint64_t upload_bytes_total(const struct upload_set *set);

#endif
