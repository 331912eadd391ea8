/* Input files on their way to disk. An upload that some connection works on is held in memory once; its writer has a ticket, and
 * taking it over (a second PATCH, or HEAD) makes older tickets stale. The SHA-256 is computed as the bytes pass and kept in the
 * database with the offset, so a file of any size needs constant memory and is never read again.
 * Bytes: JOB/upload/<id>, space reserved when declared; when complete and verified: renamed to JOB/input/<name>. */
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

/* Reserve the space of a declared file (row not yet in the database) and write its first hash state into the row.
 * STATUS_DISK_FULL leaves nothing behind. */
status upload_reserve(struct upload_set *set, struct file_row *row, struct error *err);
/* Remove the bytes of a file, complete or not, and end its writers; the row is the caller's. */
void upload_discard(struct upload_set *set, const struct file_row *row);
/* End the writers of all files of a job. */
void upload_discard_job(struct upload_set *set, const char *job_id);

/* Hold an upload: STATUS_NOT_FOUND. Every successful call is paired with upload_release. */
status upload_hold(struct upload_set *set, const char *id, struct upload **upload, struct error *err);
void upload_release(struct upload_set *set, struct upload *upload);

/* Become the writer: what earlier writers sent is made durable first. *row is the present state.
 * An upload that has all its bytes is finished here if it was not before. */
status upload_take(struct upload *upload, uint64_t *ticket, struct file_row *row, struct error *err);
/* STATUS_STALE when another writer has taken over, STATUS_DISK_FULL, STATUS_IO; the offset moves by what is written. */
status upload_write(struct upload *upload, uint64_t ticket, const void *data, size_t n_bytes, struct error *err);
/* Make durable what was written; a file that has all its bytes is verified and moved to its place.
 * STATUS_CHECKSUM: the sum differs, the upload is back at offset 0. *row (may be NULL) is the state afterwards. */
status upload_commit(struct upload *upload, uint64_t ticket, struct file_row *row, struct error *err);

/* A checksum for an upload that was declared without one: the end of the upload compares it. *row is the present state.
 * STATUS_EXISTS when the file has another checksum by now, declared or computed. */
status upload_set_checksum(struct upload_set *set, const char *id, const char *sha256, struct file_row *row,
                           struct error *err);

/* At the start of the daemon: finish what was verified but not moved, and start afresh what has lost its bytes. */
status upload_recover(struct upload_set *set, struct error *err);

/* The offset right now, without taking over; row is from the database and is brought up to date. */
void upload_refresh(struct upload_set *set, struct file_row *row);
uint64_t upload_bytes_total(const struct upload_set *set);

#endif
