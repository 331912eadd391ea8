#include "optimizer/job/options/option_key.h"
#include "optimizer/job/options/option_table.h"

#include <stdio.h>
#include <string.h>

const char *job_option_key(const char *id)
{
    JOB_OPTION_EACH(row)
    if (row->id != NULL && strcmp(row->id, id) == 0) return row->path;
    return NULL;
}

void job_option_resolve(const char *field, char *key, size_t n_bytes)
{
    char id[64];
    size_t n_id = strcspn(field, "[");
    snprintf(id, sizeof id, "%.*s", (int)n_id, field);
    const char *pattern = job_option_key(id);
    const char *place = pattern == NULL ? NULL : strstr(pattern, "[]");
    if (pattern == NULL)
        snprintf(key, n_bytes, "%s", field);
    else if (place == NULL)
        snprintf(key, n_bytes, "%s", pattern);
    else
        snprintf(key, n_bytes, "%.*s%s%s", (int)(place - pattern), pattern, field + n_id, place + 2);
}

status job_option_name_field(status code, struct error *err)
{
    if (code == STATUS_OK || err == NULL) return code;
    char key[sizeof err->field], section[64];
    job_option_resolve(err->field, key, sizeof key);
    snprintf(section, sizeof section, "%.*s", (int)strcspn(key, ".["), key);
    if (job_option_find(section) == NULL) key[0] = '\0';
    memcpy(err->field, key, sizeof key);
    return code;
}
