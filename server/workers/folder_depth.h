/* How deeply a worker has nested folders in its job's. */
#ifndef SELVEDGE_SERVER_FOLDER_DEPTH_H
#define SELVEDGE_SERVER_FOLDER_DEPTH_H

#include <stdbool.h>
#include <stdint.h>

/* Whether there is a folder more than `most` levels below a folder. Links are not followed. */
bool folder_is_deeper(const char *path, int64_t most);

#endif
