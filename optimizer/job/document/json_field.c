#include "optimizer/job/document/json_field.h"

#include "base/word_guess.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void json_field_path(const struct json_field *f, const char *key, char path[JSON_PATH_BYTES])
{
    snprintf(path, JSON_PATH_BYTES, "%s%s%.60s", f->path, f->path[0] != '\0' ? "." : "", key);
}

void json_list_text(const char *const *list, char *text, size_t n_bytes)
{
    size_t used = 0;
    text[0] = '\0';
    for (size_t i = 0; list[i] != NULL && used < n_bytes; i++) {
        int n = snprintf(text + used, n_bytes - used, "%s%s", i > 0 ? ", " : "", list[i]);
        if (n < 0) return;
        used += (size_t)n;
    }
}

static const char *json_type_text(const json_t *value)
{
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        return "a list";
    case JSON_STRING:
        return "a text";
    case JSON_INTEGER:
    case JSON_REAL:
        return "a number";
    case JSON_TRUE:
    case JSON_FALSE:
        return "true or false";
    default:
        return "null";
    }
}

status json_field_check_keys(const struct json_field *f, const char *const *allowed, struct error *err)
{
    if (!json_is_object(f->object))
        return error_set_field(err, STATUS_INVALID, f->path, "%s%s%s must be an object, but it is %s",
                               f->path[0] ? "'" : "", f->path[0] ? f->path : "the job document", f->path[0] ? "'" : "",
                               json_type_text(f->object));
    void *iter = json_object_iter((json_t *)(uintptr_t)f->object);
    for (; iter != NULL; iter = json_object_iter_next((json_t *)(uintptr_t)f->object, iter)) {
        const char *key = json_object_iter_key(iter);
        size_t i = 0;
        while (allowed[i] != NULL && strcmp(allowed[i], key) != 0) i++;
        if (allowed[i] != NULL) continue;
        char path[JSON_PATH_BYTES], list[600];
        json_field_path(f, key, path);
        json_list_text(allowed, list, sizeof list);
        const char *meant = word_guess(key, allowed);
        if (meant != NULL)
            return error_set_field(err, STATUS_INVALID, path,
                                   "unknown field '%s': did you mean '%s'? Allowed here are %s", path, meant, list);
        return error_set_field(err, STATUS_INVALID, path, "unknown field '%s': allowed here are %s", path, list);
    }
    return STATUS_OK;
}

status json_field_object(const struct json_field *f, const char *key, struct json_field *sub, bool *present,
                         struct error *err)
{
    sub->object = json_object_get(f->object, key);
    json_field_path(f, key, sub->path);
    *present = sub->object != NULL;
    if (*present && !json_is_object(sub->object))
        return error_set_field(err, STATUS_INVALID, sub->path, "'%s' must be an object, but it is %s", sub->path,
                               json_type_text(sub->object));
    return STATUS_OK;
}

static status check_number(const json_t *value, const char *path, double lower, double upper, double *out,
                           struct error *err)
{
    if (!json_is_number(value))
        return error_set_field(err, STATUS_INVALID, path, "'%s' must be a number from %g to %g, but it is %s", path,
                               lower, upper, json_type_text(value));
    double v = json_number_value(value);
    if (!isfinite(v) || v < lower || v > upper)
        return error_set_field(err, STATUS_INVALID, path, "'%s' is %g: allowed are %g to %g", path, v, lower, upper);
    *out = v;
    return STATUS_OK;
}

status json_field_number(const struct json_field *f, const char *key, double lower, double upper, double *out,
                         struct error *err)
{
    const json_t *value = json_object_get(f->object, key);
    if (value == NULL) return STATUS_OK;
    char path[JSON_PATH_BYTES];
    json_field_path(f, key, path);
    return check_number(value, path, lower, upper, out, err);
}

status json_field_required_number(const struct json_field *f, const char *key, double lower, double upper, double *out,
                                  struct error *err)
{
    if (json_object_get(f->object, key) == NULL) {
        char path[JSON_PATH_BYTES];
        json_field_path(f, key, path);
        return error_set_field(err, STATUS_INVALID, path, "'%s' is missing: give a number from %g to %g", path, lower,
                               upper);
    }
    return json_field_number(f, key, lower, upper, out, err);
}

status json_field_number_array(const struct json_field *f, const char *key, size_t n, double lower, double upper,
                               double *out, struct error *err)
{
    const json_t *value = json_object_get(f->object, key);
    if (value == NULL) return STATUS_OK;
    char path[JSON_PATH_BYTES], element[JSON_PATH_BYTES];
    json_field_path(f, key, path);
    if (!json_is_array(value) || json_array_size(value) != n)
        return error_set_field(err, STATUS_INVALID, path, "'%s' must be a list of %zu numbers", path, n);
    for (size_t i = 0; i < n; i++) {
        snprintf(element, sizeof element, "%.140s[%zu]", path, i);
        status s = check_number(json_array_get(value, i), element, lower, upper, &out[i], err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

static status check_size(const json_t *value, const char *path, size_t lower, size_t upper, size_t *out,
                         struct error *err)
{
    if (!json_is_integer(value))
        return error_set_field(err, STATUS_INVALID, path, "'%s' must be a whole number from %zu to %zu, but it is %s",
                               path, lower, upper, json_is_real(value) ? "a fraction" : json_type_text(value));
    json_int_t v = json_integer_value(value);
    if (v < 0 || (uint64_t)v < lower || (uint64_t)v > upper)
        return error_set_field(err, STATUS_INVALID, path, "'%s' is %lld: allowed are %zu to %zu", path, (long long)v,
                               lower, upper);
    *out = (size_t)v;
    return STATUS_OK;
}

status json_field_size(const struct json_field *f, const char *key, size_t lower, size_t upper, size_t *out,
                       struct error *err)
{
    const json_t *value = json_object_get(f->object, key);
    if (value == NULL) return STATUS_OK;
    char path[JSON_PATH_BYTES];
    json_field_path(f, key, path);
    return check_size(value, path, lower, upper, out, err);
}

status json_field_size_array(const struct json_field *f, const char *key, size_t n, size_t lower, size_t upper,
                             size_t *out, struct error *err)
{
    const json_t *value = json_object_get(f->object, key);
    if (value == NULL) return STATUS_OK;
    char path[JSON_PATH_BYTES], element[JSON_PATH_BYTES];
    json_field_path(f, key, path);
    if (!json_is_array(value) || json_array_size(value) != n)
        return error_set_field(err, STATUS_INVALID, path, "'%s' must be a list of %zu whole numbers", path, n);
    for (size_t i = 0; i < n; i++) {
        snprintf(element, sizeof element, "%.140s[%zu]", path, i);
        status s = check_size(json_array_get(value, i), element, lower, upper, &out[i], err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

status json_field_u64(const struct json_field *f, const char *key, uint64_t lower, uint64_t *out, struct error *err)
{
    size_t value = 0;
    if (json_object_get(f->object, key) == NULL) return STATUS_OK;
    status s = json_field_size(f, key, (size_t)lower, (size_t)INT64_MAX, &value, err);
    if (s == STATUS_OK) *out = value;
    return s;
}

status json_field_bool(const struct json_field *f, const char *key, bool *out, struct error *err)
{
    const json_t *value = json_object_get(f->object, key);
    if (value == NULL) return STATUS_OK;
    if (!json_is_boolean(value)) {
        char path[JSON_PATH_BYTES];
        json_field_path(f, key, path);
        return error_set_field(err, STATUS_INVALID, path, "'%s' must be true or false, but it is %s", path,
                               json_type_text(value));
    }
    *out = json_is_true(value);
    return STATUS_OK;
}

status json_field_choice(const struct json_field *f, const char *key, const char *const *allowed, size_t *index,
                         struct error *err)
{
    const json_t *value = json_object_get(f->object, key);
    if (value == NULL) return STATUS_OK;
    char path[JSON_PATH_BYTES], list[600];
    json_field_path(f, key, path);
    json_list_text(allowed, list, sizeof list);
    if (!json_is_string(value))
        return error_set_field(err, STATUS_INVALID, path, "'%s' must be one of %s, but it is %s", path, list,
                               json_type_text(value));
    const char *text = json_string_value(value);
    for (size_t i = 0; allowed[i] != NULL; i++) {
        if (strcmp(allowed[i], text) != 0) continue;
        *index = i;
        return STATUS_OK;
    }
    const char *meant = word_guess(text, allowed);
    if (meant != NULL)
        return error_set_field(err, STATUS_INVALID, path, "'%s' is '%.80s': did you mean '%s'? Allowed are %s", path,
                               text, meant, list);
    return error_set_field(err, STATUS_INVALID, path, "'%s' is '%.80s': allowed are %s", path, text, list);
}

status json_field_text(const struct json_field *f, const char *key, bool required, char *out, size_t n_bytes,
                       struct error *err)
{
    const json_t *value = json_object_get(f->object, key);
    char path[JSON_PATH_BYTES];
    json_field_path(f, key, path);
    if (value == NULL && !required) return STATUS_OK;
    if (value == NULL)
        return error_set_field(err, STATUS_INVALID, path, "'%s' is missing: give a text of 1 to %zu bytes", path,
                               n_bytes - 1);
    if (!json_is_string(value))
        return error_set_field(err, STATUS_INVALID, path, "'%s' must be a text, but it is %s", path,
                               json_type_text(value));
    const char *text = json_string_value(value);
    size_t n = json_string_length(value);
    if (n == 0 || n >= n_bytes)
        return error_set_field(err, STATUS_INVALID, path, "'%s' has %zu bytes: allowed are 1 to %zu", path, n,
                               n_bytes - 1);
    for (size_t i = 0; i < n; i++)
        if ((unsigned char)text[i] < 32 || text[i] == 127)
            return error_set_field(err, STATUS_INVALID, path, "'%s' must not contain control characters", path);
    memcpy(out, text, n + 1);
    return STATUS_OK;
}
