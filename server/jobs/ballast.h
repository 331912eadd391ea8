/* A file of reserved space under the data folder. On a full disk not even a deletion can be recorded: then the ballast is given up,
 * the deletion goes through, and the ballast is made again when there is room. */
#ifndef SELVEDGE_SERVER_BALLAST_H
#define SELVEDGE_SERVER_BALLAST_H

#include <stdbool.h>
#include <stdint.h>

/* Make the file when it is not there and twice its size is free. n_bytes 0: none. */
void ballast_keep(const char *data_folder, int64_t n_bytes);
/* false when there was nothing to give up */
bool ballast_release(const char *data_folder);

#endif
