#include "optimizer/tools/simulated_camera/phantom_files.h"

#include "base/files/durable.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

status phantom_path(const char *folder, const char *name, char path[PHANTOM_PATH_BYTES], struct error *err)
{
    int n = snprintf(path, PHANTOM_PATH_BYTES, "%s/%s", folder, name);
    if (n >= 0 && n < PHANTOM_PATH_BYTES) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "folder name '%.100s...' is too long", folder);
}

status phantom_json_write(const json_t *j, const char *folder, const char *name, struct error *err)
{
    char path[PHANTOM_PATH_BYTES];
    status st = phantom_path(folder, name, path, err);
    if (st != STATUS_OK) return st;
    char *text = json_dumps(j, JSON_INDENT(2) | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(9));
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    st = durable_replace(path, text, strlen(text), err);
    free(text);
    return st;
}

status phantom_json_read(const char *folder, const char *name, json_t **j, struct error *err)
{
    char path[PHANTOM_PATH_BYTES];
    json_error_t at;
    status st = phantom_path(folder, name, path, err);
    if (st != STATUS_OK) return st;
    *j = json_load_file(path, JSON_REJECT_DUPLICATES, &at);
    return *j != NULL ? STATUS_OK : error_set(err, STATUS_FORMAT, "cannot read '%s': %s", path, at.text);
}
