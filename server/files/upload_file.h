/* The file of an upload: its paths in the job's folder while it is incomplete and afterwards, the space that it
 * reserves, and the move between these paths. data: the data folder. */
#ifndef SELVEDGE_SERVER_UPLOAD_FILE_H
#define SELVEDGE_SERVER_UPLOAD_FILE_H

#include "server/settings/job_paths.h"
#include "server/store/store.h"

#include <stdbool.h>

/* JOB/upload/<id>, where the bytes arrive, and JOB/input/<name>, where the verified file ends. */
void upload_part_path(const char *data, const struct file_row *row, char out[PATH_BYTES]);
void upload_input_path(const char *data, const struct file_row *row, char out[PATH_BYTES]);
/* Sets the hash state to the state before any byte. */
void upload_hash_restart(struct file_row *row);
/* Reserves the space of n >= 1 declared files of one job, whose rows are not yet in the database, and writes the first
 * hash state to the rows. After an error nothing is left behind. STATUS_DISK_FULL, STATUS_IO. */
status upload_reserve(const char *data, struct file_row *row, size_t n, struct error *err);
/* Whether a file is one that upload_move_to_place has sealed, with the SHA-256 of `row`: it has mode 0400, and its
 * SHA-256 as an attribute of the inode. A worker in its sandbox can neither make that attribute nor open such a file
 * for writing. False on file systems without such attributes. */
bool upload_is_sealed(const char *path, const struct file_row *row);
/* Seals a verified file and moves it to its final name. May be repeated after a crash. */
status upload_move_to_place(struct store *store, const char *data, struct file_row *row, struct error *err);

#endif
