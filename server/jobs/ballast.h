/* The ballast file: a file of reserved space under the data folder. On a full disk not even a deletion can be
 * recorded. The ballast file is then removed, so that the deletion succeeds, and made again when there is space. */
#ifndef SELVEDGE_SERVER_BALLAST_H
#define SELVEDGE_SERVER_BALLAST_H

#include <stdbool.h>
#include <stdint.h>

/* Makes the file if it does not exist and twice its size is free. n_bytes 0: no file. */
void ballast_keep(const char *data_folder, int64_t n_bytes);
/* Returns false if there was no file to remove. */
bool ballast_release(const char *data_folder);

#endif
