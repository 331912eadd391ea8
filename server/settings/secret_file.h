/* Files with secrets: keys and passwords that other users must not be able to read. */
#ifndef SELVEDGE_SERVER_SECRET_FILE_H
#define SELVEDGE_SERVER_SECRET_FILE_H

#include "base/status.h"

#include <stddef.h>

/* Reads a file of at most `most` bytes; the caller wipes and frees *text, which has *n bytes (n NULL: unwanted) and a
 * zero after them. `setting` names the setting in errors. STATUS_INVALID when the group or others have any permission,
 * except below $CREDENTIALS_DIRECTORY: to those files systemd admits only the service, but by access lists, which show
 * as permissions of the group (systemd.exec, LoadCredential). STATUS_IO, STATUS_NO_MEMORY. */
status secret_file_read(const char *path, const char *setting, size_t most, char **text, size_t *n, struct error *err);

#endif
