#include "base/files/derived_document.h"
#include "base/option_id.h"

#include <stdio.h>
#include <string.h>

/* Members of `wanted`: the results, and the sections in whose light they are shown. */
static const char *const shown[] = {"pictures", "twin", "export"};
static const char *const light[] = {"lamp", "environment", "black_sheet", "camera"};
enum { N_SHOWN = sizeof shown / sizeof *shown, N_LIGHT = sizeof light / sizeof *light, NAME_BYTES = 200 };

static bool is_one_of(const char *key, const char *const *list, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(key, list[i]) == 0) return true;
    return false;
}

static status check_wanted(const json_t *wanted, struct error *err)
{
    const char *key;
    json_t *value;
    size_t n_shown = 0;
    if (!json_is_object(wanted))
        return error_set(err, STATUS_INVALID, "the request must be an object with pictures, twin or export");
    json_object_foreach((json_t *)wanted, key, value)
    {
        n_shown += is_one_of(key, shown, N_SHOWN);
        if (is_one_of(key, shown, N_SHOWN) || is_one_of(key, light, N_LIGHT) || strcmp(key, "sample") == 0) continue;
        return error_set_field(err, STATUS_INVALID, key,
                               "'%.60s' is unknown: allowed are pictures, twin, export, sample, lamp, environment, "
                               "camera and black_sheet",
                               key);
    }
    if (n_shown > 0) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "pictures", "nothing is asked for: give pictures, twin or export");
}

/* Makes the section "fit": the model of the result with its parameters and its seed. groups: receives the names of
 * their sets. */
static json_t *fixed_fit(const json_t *result, json_t *groups)
{
    const json_t *list = json_object_get(result, "parameters"), *p;
    json_t *fixed = json_object(), *fit = json_pack("{s:O, s:o, s:s}", "model", json_object_get(result, "model"),
                                                    "fixed", fixed, "result_file", DERIVED_RESULT);
    const char *last = NULL;
    size_t i;
    const json_t *seed = json_object_get(result, "seed");
    if (json_is_integer(seed)) json_object_set_new(fit, "seed", json_integer(json_integer_value(seed)));
    json_array_foreach(list, i, p)
    {
        const char *name = json_string_value(json_object_get(p, "name")),
                   *set = json_string_value(json_object_get(p, "set"));
        if (name == NULL) continue;
        if (strcmp(name, "density_multiplier") == 0) {
            json_object_set(fit, "density_multiplier_per_cm", json_object_get(p, "value"));
            continue;
        }
        json_object_set(fixed, name, json_object_get(p, "value"));
        if (set != NULL && (last == NULL || strcmp(last, set) != 0)) json_array_append_new(groups, json_string(set));
        last = set;
    }
    return fit;
}

/* Copies the sections of the finished job that light and camera follow from; those of `wanted` count more. */
static void copy_light(const json_t *from, const json_t *wanted, json_t *to)
{
    static const char *const of_camera[] = {"distance_cm", "far_field", "crop_cm"};
    for (size_t i = 0; i < N_LIGHT; i++) {
        json_t *own = json_object_get(wanted, light[i]), *value = own != NULL ? own : json_object_get(from, light[i]);
        if (value == NULL) continue;
        if (own != NULL || strcmp(light[i], "camera") != 0) {
            json_object_set(to, light[i], value);
            continue;
        }
        json_t *camera = json_object();
        for (size_t k = 0; k < sizeof of_camera / sizeof *of_camera; k++)
            if (json_object_get(value, of_camera[k]) != NULL)
                json_object_set(camera, of_camera[k], json_object_get(value, of_camera[k]));
        if (json_object_size(camera) > 0) json_object_set(to, "camera", camera);
        json_decref(camera);
    }
}

/* Cuts text after at most n bytes, and not inside of a UTF-8 character. */
static void cut(char *text, size_t n)
{
    if (strlen(text) <= n) return;
    while (n > 0 && ((unsigned char)text[n] & 0xc0) == 0x80) n--;
    text[n] = '\0';
}

/* "blue twill on drape", "blue twill for mitsuba, usd", "blue twill, twin". */
static void name_sample(const char *sample, const json_t *wanted, char name[NAME_BYTES])
{
    char before[NAME_BYTES], after[NAME_BYTES] = "";
    const char *on = json_string_value(json_object_get(json_array_get(json_object_get(wanted, "pictures"), 0), "on")),
               *key;
    json_t *value;
    snprintf(before, sizeof before, "%s", sample);
    cut(before, NAME_BYTES / 2);
    if (on != NULL)
        snprintf(after, sizeof after, " on %.20s", on);
    else if (json_object_get(wanted, "export") != NULL)
        json_object_foreach(json_object_get(wanted, "export"), key, value)
        {
            const size_t n = strlen(after);
            if (json_is_true(value))
                snprintf(after + n, n < 60 ? sizeof after - n : 0, "%s%.20s", n == 0 ? " for " : ", ", key);
        }
    else
        snprintf(after, sizeof after, ", twin");
    snprintf(name, NAME_BYTES, "%.100s%.90s", before, after);
}

/* What the cloth is, for exports. */
static void copy_label(const json_t *from, json_t *to)
{
    static const char *const key[] = {"composition", "weight_g_m2"};
    for (size_t i = 0; i < sizeof key / sizeof *key; i++)
        if (json_object_get(from, key[i]) != NULL) json_object_set(to, key[i], json_object_get(from, key[i]));
}

static status find_files(const json_t *from, const json_t *document, struct derived_files *files, struct error *err)
{
    const json_t *own = json_object_get(from, "environment"), *light_of = json_object_get(document, "environment");
    const char *around = json_string_value(json_object_get(light_of, "file")),
               *before = json_string_value(json_object_get(own, "file"));
    *files = (struct derived_files){
        .result = json_string_value(json_object_get(json_object_get(from, "fit"), "result_file"))};
    if (around == NULL) return STATUS_OK;
    files->environment = before;
    if (before != NULL && strcmp(around, before) == 0) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_ENVIRONMENT_FILE, "the finished job has no file '%.100s'",
                           around);
}

/* A PDF is made of the report of the finished job. */
static void take_report(json_t *d, struct derived_files *files)
{
    json_t *export = json_object_get(d, "export");
    files->report = json_is_true(json_object_get(export, "pdf"));
    if (!files->report) return;
    export = json_deep_copy(export); /* it is shared with the request */
    json_object_set_new(export, "report_file", json_string(DERIVED_REPORT));
    json_object_set_new(d, "export", export);
}

status derived_document_make(const json_t *document, const json_t *result, const json_t *wanted, json_t **out,
                             struct derived_files *files, struct error *err)
{
    const char *sample = json_string_value(json_object_get(result, "sample"));
    json_t *own = json_object_get(wanted, "sample");
    char name[NAME_BYTES];
    status s = check_wanted(wanted, err);
    if (s != STATUS_OK) return s;
    if (json_array_size(json_object_get(result, "parameters")) == 0 ||
        !json_is_string(json_object_get(result, "model")) || json_object_get(document, "profile") != NULL)
        return error_set(err, STATUS_CONFLICT, "the job has no cloth with a fitted model to show");
    name_sample(sample != NULL ? sample : "cloth", wanted, name);
    json_t *groups = json_array(), *fit = fixed_fit(result, groups);
    json_t *d = json_pack("{s:o, s:{s:s}, s:o}", "sample", own != NULL ? json_incref(own) : json_string(name), "fibers",
                          "file", DERIVED_FIBERS, "fit", fit);
    if (json_array_size(groups) > 1) json_object_set(json_object_get(d, "fibers"), "groups", groups);
    json_decref(groups);
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the job document: out of memory");
    copy_light(document, wanted, d);
    copy_label(document, d);
    for (size_t i = 0; i < N_SHOWN; i++)
        if (json_object_get(wanted, shown[i]) != NULL) json_object_set(d, shown[i], json_object_get(wanted, shown[i]));
    s = find_files(document, d, files, err);
    if (s == STATUS_OK) take_report(d, files);
    if (s == STATUS_OK)
        *out = d;
    else
        json_decref(d);
    return s;
}
