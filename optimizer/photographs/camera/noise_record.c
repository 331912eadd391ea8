#include "optimizer/photographs/camera/noise_record.h"

#include "base/files/durable.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_BYTES = 1 << 16, VERSION = 1 };

static const struct {
    const char *key;
    size_t at;
    bool may_be_negative;
} member[] = {
    {"read_mean_dn", offsetof(struct noise_channel, read_mean), true},
    {"read_var_dn2", offsetof(struct noise_channel, read_var), false},
    {"dark_mean_dn_per_s", offsetof(struct noise_channel, dark_mean), true},
    {"dark_var_dn2_per_s", offsetof(struct noise_channel, dark_var), false},
    {"shot_var_dn", offsetof(struct noise_channel, shot_var), false},
};
enum { N_MEMBER = sizeof member / sizeof *member };

static status read_member(const json_t *json, size_t i, const char *name, struct noise_record *r, struct error *err)
{
    const json_t *list = json_object_get(json, member[i].key);
    for (size_t c = 0; c < 3; c++) {
        const json_t *v = json_array_size(list) == 3 ? json_array_get(list, c) : NULL;
        double value = json_is_number(v) ? json_number_value(v) : NAN;
        if (!isfinite(value) || (!member[i].may_be_negative && value < 0.0) || fabs(value) > 1e12)
            return error_set(err, STATUS_FORMAT,
                             "cannot use noise record '%s': '%s' must be three %snumbers, for red, green and blue",
                             name, member[i].key, member[i].may_be_negative ? "" : "non-negative ");
        memcpy((char *)&r->channel[c] + member[i].at, &value, sizeof value);
    }
    return STATUS_OK;
}

static status read_json(const json_t *json, const char *name, struct noise_record *r, struct error *err)
{
    if (json_integer_value(json_object_get(json, "selvedge_camera_noise")) != VERSION)
        return error_set(err, STATUS_FORMAT,
                         "cannot use noise record '%s': 'selvedge_camera_noise' is not %d: make the file by `selvedge "
                         "calibrate-camera`",
                         name, VERSION);
    for (size_t i = 0; i < N_MEMBER; i++) {
        status s = read_member(json, i, name, r, err);
        if (s != STATUS_OK) return s;
    }
    for (size_t c = 0; c < 3; c++)
        if (!(r->channel[c].read_var + r->channel[c].shot_var > 0.0))
            return error_set(err, STATUS_INVALID, "cannot use noise record '%s': it states no noise at all", name);
    const json_t *iso = json_object_get(json, "iso"), *camera = json_object_get(json, "camera");
    r->iso = json_is_number(iso) ? json_number_value(iso) : NAN;
    if (json_is_string(camera)) snprintf(r->camera, sizeof r->camera, "%s", json_string_value(camera));
    r->n_dark = (size_t)json_integer_value(json_object_get(json, "n_dark"));
    r->n_flat = (size_t)json_integer_value(json_object_get(json, "n_flat"));
    return STATUS_OK;
}

status noise_record_read(const char *path, struct noise_record *r, struct error *err)
{
    char *text = NULL;
    size_t n = 0;
    json_error_t at;
    *r = (struct noise_record){0};
    status s = file_read_all(path, MAX_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    json_t *json = json_loadb(text, n, JSON_REJECT_DUPLICATES, &at);
    s = json != NULL ? read_json(json, path_file_name(path), r, err)
                     : error_set(err, STATUS_FORMAT, "cannot use noise record '%s': it is not JSON: line %d: %s",
                                 path_file_name(path), at.line, at.text);
    json_decref(json);
    free(text);
    return s;
}

status noise_record_write(const struct noise_record *r, const char *path, struct error *err)
{
    json_t *json =
        json_pack("{s:i, s:s?, s:o, s:I, s:I}", "selvedge_camera_noise", VERSION, "camera",
                  r->camera[0] != '\0' ? r->camera : NULL, "iso", isnan(r->iso) ? json_null() : json_real(r->iso),
                  "n_dark", (json_int_t)r->n_dark, "n_flat", (json_int_t)r->n_flat);
    for (size_t i = 0; i < N_MEMBER; i++) {
        json_t *list = json_array();
        for (size_t c = 0; c < 3; c++) {
            double value;
            memcpy(&value, (const char *)&r->channel[c] + member[i].at, sizeof value);
            json_array_append_new(list, json_real(value));
        }
        json_object_set_new(json, member[i].key, list);
    }
    char *text = json_dumps(json, JSON_INDENT(2) | JSON_REAL_PRECISION(12));
    json_decref(json);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write noise record '%s': out of memory", path);
    status s = durable_replace(path, text, strlen(text), err);
    free(text);
    return s;
}
