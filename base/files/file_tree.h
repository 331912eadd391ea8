/* Removal of folders with everything in them, whatever program wrote it: folders may be nested to any depth, and their
 * paths may be longer than the system takes. Links are removed and never followed. Memory, stack and open files do not
 * grow with the depth. */
#ifndef SELVEDGE_FILE_TREE_H
#define SELVEDGE_FILE_TREE_H

#include "base/status.h"

/* Removes a file or a folder with its content. A missing one is no error. STATUS_IO, STATUS_DISK_FULL. */
status file_tree_remove(const char *path, struct error *err);

#endif
