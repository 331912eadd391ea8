/* Opens files below a folder that somebody else may write, such as a worker that its input has taken over. Only regular
 * files count: a link, pipe, device, folder or unreadable file counts as absent, so that no caller follows it or waits
 * for it. */
#ifndef SELVEDGE_BASE_FOREIGN_FILE_H
#define SELVEDGE_BASE_FOREIGN_FILE_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Opens folder/name for reading. name: parts separated by '/'; none may be a link. *size (may be NULL): bytes of the
 * file. STATUS_NOT_FOUND, STATUS_IO. */
status foreign_file_open(const char *folder, const char *name, int *fd, uint64_t *size, struct error *err);
/* Reads such a file into memory, as file_read_all does. STATUS_TOO_LARGE beyond limit_bytes, STATUS_NOT_FOUND,
 * STATUS_IO, STATUS_NO_MEMORY. */
status foreign_file_read(const char *folder, const char *name, size_t limit_bytes, char **data, size_t *n_bytes,
                         struct error *err);
/* Makes way for a file that is to be written: whatever has the name but is no regular file is removed, because a pipe
 * would be waited for and a link would be followed. A folder is renamed instead. STATUS_IO. */
status foreign_file_clear(const char *path, struct error *err);
/* durable_replace, or with sync false durable_replace_volatile, of such a file. */
status foreign_file_replace(const char *path, const void *data, size_t n_bytes, bool sync, struct error *err);
/* Makes way for a folder that is to be written into: whatever has the name but is no folder is removed. STATUS_IO. */
status foreign_folder_clear(const char *path, struct error *err);

#endif
