/* Inside the phantom program: the files of a folder that it makes. */
#ifndef SELVEDGE_OPTIMIZER_PHANTOM_FILES_H
#define SELVEDGE_OPTIMIZER_PHANTOM_FILES_H

#include "base/status.h"

#include <jansson.h>

enum { PHANTOM_PATH_BYTES = 4096 };

/* Makes "folder/name". STATUS_INVALID when it is too long. */
status phantom_path(const char *folder, const char *name, char path[PHANTOM_PATH_BYTES], struct error *err);
/* Writes FOLDER/NAME durably, indented, with nine digits. */
status phantom_json_write(const json_t *j, const char *folder, const char *name, struct error *err);
/* Reads FOLDER/NAME. STATUS_FORMAT for anything but JSON. The caller gives *j up. */
status phantom_json_read(const char *folder, const char *name, json_t **j, struct error *err);

#endif
