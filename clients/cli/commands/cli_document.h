/* Files that somebody gives in place of a job document. */
#ifndef SELVEDGE_CLIENTS_CLI_DOCUMENT_H
#define SELVEDGE_CLIENTS_CLI_DOCUMENT_H

#include "base/status.h"

/* STATUS_INVALID for a folder and for a file that does not begin as a JSON object does; the error tells which command
 * takes such a file, by its name. STATUS_NOT_FOUND. */
status cli_document_check(const char *path, struct error *err);

#endif
