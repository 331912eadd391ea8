/* The file of an upload: its two places in the job's folder, the space that it reserves, and the move from the one
 * place to the other. data: the data folder. */
#ifndef SELVEDGE_SERVER_UPLOAD_FILE_H
#define SELVEDGE_SERVER_UPLOAD_FILE_H

#include "server/settings/job_paths.h"
#include "server/store/store.h"

/* JOB/upload/<id>, where the bytes arrive, and JOB/input/<name>, where the verified file ends. */
void upload_part_path(const char *data, const struct file_row *row, char out[PATH_BYTES]);
void upload_input_path(const char *data, const struct file_row *row, char out[PATH_BYTES]);
/* Sets the hash state to that of no bytes. */
void upload_hash_restart(struct file_row *row);
/* Reserves the space of n >= 1 declared files of one job, whose rows are not yet in the database, and writes the first
 * hash state to the rows. After an error nothing is left behind. STATUS_DISK_FULL, STATUS_IO. */
status upload_reserve(const char *data, struct file_row *row, size_t n, struct error *err);
/* Moves a verified file to its final name. May be repeated after a crash. */
status upload_move_to_place(struct store *store, const char *data, struct file_row *row, struct error *err);

#endif
