/* Disk that a folder takes. */
#ifndef SELVEDGE_BASE_DISK_USE_H
#define SELVEDGE_BASE_DISK_USE_H

#include <stdint.h>

/* Bytes of the blocks of all files and folders below a path, itself included. Links are not followed, and a file with
 * several names counts in equal parts for each of them. 0 when it cannot be read. */
int64_t disk_use_bytes(const char *path);
/* Sum of the sizes of all files below a path. 0 when it cannot be read. */
int64_t disk_content_bytes(const char *path);

#endif
