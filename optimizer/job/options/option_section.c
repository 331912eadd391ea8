#include "optimizer/job/options/option_section.h"
#include "optimizer/job/options/option_table.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* The one section in which a key stands; false: there is none or more than one. */
static bool section_of_key(const char *key, char section[JSON_PATH_BYTES])
{
    size_t n = 0;
    JOB_OPTION_EACH(row)
    {
        const char *dot = strrchr(row->path, '.');
        if (dot == NULL || strcmp(dot + 1, key) != 0) continue;
        snprintf(section, JSON_PATH_BYTES, "%.*s", (int)(dot - row->path), row->path);
        n++;
    }
    return n == 1;
}

static status check_keys(const struct json_field *f, const char *const *allowed, struct error *err)
{
    status s = json_field_check_keys(f, allowed, err);
    const char *last = s != STATUS_OK && err->field[0] != '\0' ? strrchr(err->field, '.') : NULL;
    char section[JSON_PATH_BYTES], path[JSON_PATH_BYTES];
    if (s == STATUS_OK || !json_is_object(f->object)) return s;
    snprintf(path, sizeof path, "%s", err->field);
    if (!section_of_key(last != NULL ? last + 1 : err->field, section)) return s;
    return error_set_field(err, s, path, "unknown field '%s': it belongs in '%s'", path, section);
}

status job_option_check_keys(const struct json_field *f, const char *const *allowed, struct job_fault_list *faults,
                             struct error *err)
{
    struct error fault = {0};
    const char *key;
    json_t *value, *object = (json_t *)(uintptr_t)f->object;
    status s = check_keys(f, allowed, &fault);
    if (s == STATUS_OK) return s;
    if (faults == NULL) {
        if (err != NULL) *err = fault;
        return s;
    }
    if (!json_is_object(object)) {
        job_faults_add(faults, &fault);
        return STATUS_OK;
    }
    json_object_foreach(object, key, value)
    {
        struct json_field one = *f;
        one.object = json_pack("{s:O}", key, value);
        if (one.object == NULL) continue;
        if (check_keys(&one, allowed, &fault) != STATUS_OK) job_faults_add(faults, &fault);
        json_decref((json_t *)(uintptr_t)one.object);
    }
    return STATUS_OK;
}
