/* The disk that folders take, and removal of folders with everything in them, whatever program wrote it: folders may be
 * nested to any depth, and their paths may be longer than the system takes. Links are removed and never followed.
 * Memory, stack and open files of a removal do not grow with the depth. */
#ifndef SELVEDGE_FILE_TREE_H
#define SELVEDGE_FILE_TREE_H

#include "base/status.h"

#include <stdint.h>

/* Removes a file or a folder with its content. A missing one is no error. STATUS_IO, STATUS_DISK_FULL. */
status file_tree_remove(const char *path, struct error *err);

/* Bytes of the blocks of all files and folders below a path, itself included. Links are not followed, and a file with
 * several names counts in equal parts for each of them. 0 when it cannot be read. */
int64_t disk_use_bytes(const char *path);
/* Sum of the sizes of all files below a path. 0 when it cannot be read. */
int64_t disk_content_bytes(const char *path);

#endif
