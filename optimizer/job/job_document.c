#include "optimizer/job/job_document.h"
#include "base/catalogue/method_catalogue.h"
#include "optimizer/job/job_document_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const root_key[] = {"sample",      "volume",       "fibers",      "lamp", "camera",
                                       "black_sheet", "measurements", "photographs", "fit",  NULL};

static const char name_allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";

bool job_file_name_valid(const char *name)
{
    size_t n = strlen(name);
    if (n == 0 || n >= JOB_MAX_NAME_BYTES || name[0] == '.') return false;
    return strspn(name, name_allowed) == n;
}

void job_file_name_make_valid(const char *text, char name[JOB_MAX_NAME_BYTES])
{
    snprintf(name, JOB_MAX_NAME_BYTES, "%s", text);
    if (name[0] == '.' || name[0] == '\0') snprintf(name, JOB_MAX_NAME_BYTES, "_%s", text[0] != '\0' ? text + 1 : "");
    for (char *p = name + strspn(name, name_allowed); *p != '\0'; p += strspn(p, name_allowed)) *p = '_';
}

status job_check_file_name(const char *path, const char *name, struct error *err)
{
    if (job_file_name_valid(name)) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, path,
        "'%s' is '%.140s': a file name has 1 to %d characters out of A-Z a-z 0-9 . _ - and does not start with a dot",
        path, name, JOB_MAX_NAME_BYTES - 1);
}

status job_parse_file_name(const struct json_field *f, const char *key, char out[JOB_MAX_NAME_BYTES], struct error *err)
{
    char path[JSON_PATH_BYTES], name[JOB_MAX_NAME_BYTES];
    json_field_path(f, key, path);
    status s = json_field_text(f, key, true, name, sizeof name, err);
    if (s != STATUS_OK) return s;
    s = job_check_file_name(path, name, err);
    if (s == STATUS_OK) memcpy(out, name, sizeof name);
    return s;
}

static void fill_nan(double *v, size_t n)
{
    for (size_t i = 0; i < n; i++) v[i] = NAN;
}

static struct job_document *document_new(void)
{
    struct job_document *d = calloc(1, sizeof *d);
    if (d == NULL) return NULL;
    fill_nan(d->voxel_size_um, 3);
    memcpy(d->axes, "xyz", 4);
    d->matrix[0] = d->matrix[4] = d->matrix[8] = 1.0;
    d->density_low = d->density_high = d->filter_s = d->filter_t = d->filter_eps_d = d->filter_eps_j = NAN;
    d->link_sigma_voxel = d->radius_um = d->crop_keep = NAN;
    d->radius_per_axis = -1;
    d->join_seams = true;
    fill_nan(d->tile_mm, 2);
    d->voxel_um = NAN;
    d->lamp_side_cm = 10.0;
    d->lamp_distance_cm = 61.0;
    d->camera_distance_cm = 100.0;
    d->crop_cm = 1.0;
    d->black_sheet = true;
    snprintf(d->method, sizeof d->method, "%s", method_catalogue_at(0)->id);
    d->seed = 1;
    d->n_model = 1;
    snprintf(d->model[0].id, sizeof d->model[0].id, "%s", model_catalogue_at(0)->id);
    for (size_t i = 0; i < JOB_MAX_MODEL; i++) {
        fill_nan(d->model[i].fixed, JOB_MAX_PARAM);
        fill_nan(d->model[i].start, JOB_MAX_PARAM);
        job_fit_option_init(&d->model[i].option);
    }
    d->density_multiplier_per_cm = d->radius_lower_um = d->radius_upper_um = NAN;
    d->render_px = 96;
    d->render_sample = 16;
    return d;
}

void job_document_free(struct job_document *doc)
{
    if (doc == NULL) return;
    free(doc->volume_file);
    free(doc->photograph);
    free(doc->candidate);
    free(doc);
}

static status parse_sample(const struct json_field *root, struct job_document *doc, struct error *err)
{
    status s = json_field_text(root, "sample", true, doc->sample, sizeof doc->sample, err);
    if (s != STATUS_OK) return s;
    size_t n = 0;
    for (const char *p = doc->sample; *p != '\0'; p++)
        if (((unsigned char)*p & 0xC0) != 0x80) n++;
    if (n > 200)
        return error_set_field(err, STATUS_INVALID, "sample", "'sample' has %zu characters: allowed are 1 to 200", n);
    return STATUS_OK;
}

/* Exactly one of "volume" and "fibers". */
static status parse_cloth(const struct json_field *root, struct job_document *doc, struct error *err)
{
    struct json_field volume, fibers;
    bool has_fibers = false;
    status s = json_field_object(root, "volume", &volume, &doc->has_volume, err);
    if (s == STATUS_OK) s = json_field_object(root, "fibers", &fibers, &has_fibers, err);
    if (s != STATUS_OK) return s;
    if (doc->has_volume && has_fibers)
        return error_set_field(err, STATUS_INVALID, "fibers",
                               "'volume' and 'fibers' are both given: a job takes one of them");
    if (!doc->has_volume && !has_fibers)
        return error_set_field(err, STATUS_INVALID, "volume",
                               "'volume' is missing: give a scan ('volume') or a fiber file ('fibers')");
    return has_fibers ? job_parse_fibers(&fibers, doc, err) : job_parse_volume(&volume, doc, err);
}

static status parse_setup(const struct json_field *root, struct job_document *doc, struct error *err)
{
    static const char *const lamp_key[] = {"side_cm", "distance_cm", NULL};
    static const char *const camera_key[] = {"distance_cm", "crop_cm", NULL};
    struct json_field f;
    bool present;
    status s = json_field_object(root, "lamp", &f, &present, err);
    if (s == STATUS_OK && present) {
        s = json_field_check_keys(&f, lamp_key, err);
        if (s == STATUS_OK) s = json_field_number(&f, "side_cm", 0.01, 1000.0, &doc->lamp_side_cm, err);
        if (s == STATUS_OK) s = json_field_number(&f, "distance_cm", 1.0, 100000.0, &doc->lamp_distance_cm, err);
        if (s == STATUS_OK && doc->lamp_side_cm > 2.0 * doc->lamp_distance_cm)
            s = error_set_field(err, STATUS_INVALID, "lamp.side_cm",
                                "'lamp.side_cm' is %g: allowed is at most twice lamp.distance_cm (%g)",
                                doc->lamp_side_cm, doc->lamp_distance_cm);
    }
    if (s == STATUS_OK) s = json_field_object(root, "camera", &f, &present, err);
    if (s == STATUS_OK && present) {
        s = json_field_check_keys(&f, camera_key, err);
        if (s == STATUS_OK) s = json_field_number(&f, "distance_cm", 1.0, 100000.0, &doc->camera_distance_cm, err);
        if (s == STATUS_OK) s = json_field_number(&f, "crop_cm", 0.01, 100.0, &doc->crop_cm, err);
        if (s == STATUS_OK && doc->crop_cm > doc->camera_distance_cm)
            s = error_set_field(err, STATUS_INVALID, "camera.crop_cm",
                                "'camera.crop_cm' is %g: allowed is at most camera.distance_cm (%g)", doc->crop_cm,
                                doc->camera_distance_cm);
    }
    if (s == STATUS_OK) s = json_field_bool(root, "black_sheet", &doc->black_sheet, err);
    return s;
}

/* Exactly one of "measurements" and "photographs". */
static status parse_observations(const struct json_field *root, struct job_document *doc, struct error *err)
{
    static const char *const measurement_key[] = {"file", NULL};
    struct json_field f;
    bool has_measurements, has_photographs = json_object_get(root->object, "photographs") != NULL;
    status s = json_field_object(root, "measurements", &f, &has_measurements, err);
    if (s != STATUS_OK) return s;
    if (has_measurements && has_photographs)
        return error_set_field(err, STATUS_INVALID, "photographs",
                               "'measurements' and 'photographs' are both given: a job takes one of them");
    if (!has_measurements && !has_photographs)
        return error_set_field(err, STATUS_INVALID, "photographs",
                               "'photographs' is missing: give a list of photographs, or 'measurements' with a table");
    if (has_photographs) return job_parse_photographs(root, doc, err);
    s = json_field_check_keys(&f, measurement_key, err);
    if (s == STATUS_OK) s = job_parse_file_name(&f, "file", doc->measurement_file, err);
    return s;
}

/* What the front shows hardly depends on density: the fit of it wants light that went through the cloth. (Rows of a
 * table are looked at when it is read.) */
static status check_density(const struct job_document *doc, struct error *err)
{
    bool from_behind = false;
    for (size_t i = 0; i < doc->n_photograph; i++)
        if (doc->photograph[i].set == JOB_SET_FIT && doc->photograph[i].light_theta_deg > 90.0) from_behind = true;
    if (!doc->fit_density || from_behind || (doc->n_photograph == 0 && !doc->black_sheet)) return STATUS_OK;
    return job_density_undetermined(doc->black_sheet, err);
}

status job_density_undetermined(bool black_sheet, struct error *err)
{
    return error_set_field(err, STATUS_INVALID, "fit.fit_density",
                           "'fit.fit_density' cannot be fitted: no photograph to be fitted has the lamp behind the "
                           "cloth (light_theta_deg above 90%s), and from the front brightness hardly depends on "
                           "density; add one, or give density_multiplier_per_cm",
                           black_sheet ? ", black_sheet false" : "");
}

/* ---- no file twice ---- */

struct name_list {
    const char **name;
    size_t n;
    const char *duplicate;
};

static int compare_names(const void *a, const void *b)
{
    const char *const *x = a, *const *y = b;
    return strcmp(*x, *y);
}

static void collect_name(void *context, const char *name, const char *role)
{
    struct name_list *list = context;
    (void)role;
    list->name[list->n++] = name;
}

static status check_duplicates(const struct job_document *doc, struct error *err)
{
    struct name_list list = {0};
    list.name = malloc((doc->n_volume_file + doc->n_photograph + 2) * sizeof *list.name);
    if (list.name == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot check the job document: out of memory");
    job_document_visit_files(doc, collect_name, &list);
    qsort(list.name, list.n, sizeof *list.name, compare_names);
    for (size_t i = 1; i < list.n && list.duplicate == NULL; i++)
        if (strcmp(list.name[i - 1], list.name[i]) == 0) list.duplicate = list.name[i];
    status s = STATUS_OK;
    if (list.duplicate != NULL) {
        char path[JSON_PATH_BYTES] = "measurements.file";
        for (size_t i = 0; i < doc->n_volume_file; i++)
            if (strcmp(doc->volume_file[i], list.duplicate) == 0) snprintf(path, sizeof path, "volume.files[%zu]", i);
        for (size_t i = 0; i < doc->n_photograph; i++)
            if (strcmp(doc->photograph[i].file, list.duplicate) == 0)
                snprintf(path, sizeof path, "photographs[%zu].file", i);
        s = error_set_field(err, STATUS_INVALID, path,
                            "'%s' names the file '%s' a second time: each input file has one use", path,
                            list.duplicate);
    }
    free(list.name);
    return s;
}

status job_document_parse(const char *text, size_t n_bytes, struct job_document **doc, struct error *err)
{
    struct job_document *d = NULL;
    json_t *json = NULL;
    status s = STATUS_OK;
    if (n_bytes > JOB_MAX_DOCUMENT_BYTES)
        return error_set(err, STATUS_TOO_LARGE, "the job document has %zu bytes, the limit is %d", n_bytes,
                         JOB_MAX_DOCUMENT_BYTES);
    json_error_t at;
    json = json_loadb(text, n_bytes, JSON_REJECT_DUPLICATES, &at);
    if (json == NULL)
        return error_set(err, STATUS_INVALID, "the job document is not valid JSON: line %d, column %d: %s", at.line,
                         at.column, at.text);
    d = document_new();
    if (d == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
        goto out;
    }
    struct json_field root = {.object = json}, fit;
    bool has_fit = false;
    s = json_field_check_keys(&root, root_key, err);
    if (s == STATUS_OK) s = parse_sample(&root, d, err);
    if (s == STATUS_OK) s = parse_cloth(&root, d, err);
    if (s == STATUS_OK) s = parse_setup(&root, d, err);
    if (s == STATUS_OK) s = parse_observations(&root, d, err);
    if (s == STATUS_OK) s = json_field_object(&root, "fit", &fit, &has_fit, err);
    if (s == STATUS_OK && has_fit) s = job_parse_fit(&fit, d, err);
    if (s == STATUS_OK) s = check_density(d, err);
    if (s == STATUS_OK) s = check_duplicates(d, err);
    if (s != STATUS_OK) goto out;
    *doc = d;
    d = NULL;
out:
    job_document_free(d);
    json_decref(json);
    return s;
}

void job_document_visit_files(const struct job_document *doc,
                              void (*visit)(void *context, const char *name, const char *role), void *context)
{
    for (size_t i = 0; i < doc->n_volume_file; i++) visit(context, doc->volume_file[i], "volume");
    if (doc->fiber_file[0] != '\0') visit(context, doc->fiber_file, "fibers");
    if (doc->measurement_file[0] != '\0') visit(context, doc->measurement_file, "measurements");
    for (size_t i = 0; i < doc->n_photograph; i++) visit(context, doc->photograph[i].file, "photograph");
}
