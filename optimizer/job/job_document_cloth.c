/* The sections "volume", "fibers" and "photographs" of a job document. */
#include "optimizer/job/job_document_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static status parse_files(const struct json_field *f, struct job_document *doc, struct error *err)
{
    char path[JSON_PATH_BYTES], element[JSON_PATH_BYTES];
    json_field_path(f, "files", path);
    const json_t *list = json_object_get(f->object, "files");
    if (!json_is_array(list) || json_array_size(list) == 0 || json_array_size(list) > JOB_MAX_VOLUME_FILE)
        return error_set_field(err, STATUS_INVALID, path, "'%s' must be a list of 1 to %d file names", path,
                               JOB_MAX_VOLUME_FILE);
    size_t n = json_array_size(list);
    doc->volume_file = calloc(n, sizeof *doc->volume_file);
    if (doc->volume_file == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    for (size_t i = 0; i < n; i++) {
        const json_t *item = json_array_get(list, i);
        snprintf(element, sizeof element, "%.140s[%zu]", path, i);
        if (!json_is_string(item))
            return error_set_field(err, STATUS_INVALID, element, "'%s' must be a text: the name of an input file",
                                   element);
        status s = job_check_file_name(element, json_string_value(item), err);
        if (s != STATUS_OK) return s;
        snprintf(doc->volume_file[i], JOB_MAX_NAME_BYTES, "%s", json_string_value(item));
        doc->n_volume_file++;
    }
    return STATUS_OK;
}

static status parse_voxel_size(const struct json_field *f, struct job_document *doc, struct error *err)
{
    const json_t *v = json_object_get(f->object, "voxel_size_um");
    if (v == NULL) return STATUS_OK;
    if (json_is_array(v)) return json_field_number_array(f, "voxel_size_um", 3, 0.01, 1000.0, doc->voxel_size_um, err);
    status s = json_field_number(f, "voxel_size_um", 0.01, 1000.0, &doc->voxel_size_um[0], err);
    doc->voxel_size_um[1] = doc->voxel_size_um[2] = doc->voxel_size_um[0];
    return s;
}

/* Three of x, y, z in any order, each with an optional minus sign. */
static bool axes_valid(const char *text)
{
    unsigned seen = 0;
    size_t n = 0;
    for (const char *p = text; *p != '\0'; p++, n++) {
        if (*p == '-') p++;
        if (*p < 'x' || *p > 'z') return false;
        seen |= 1u << (*p - 'x');
    }
    return n == 3 && seen == 7;
}

static status parse_axes(const struct json_field *f, struct job_document *doc, struct error *err)
{
    char text[sizeof doc->axes], path[JSON_PATH_BYTES];
    memcpy(text, doc->axes, sizeof text);
    status s = json_field_text(f, "axes", false, text, sizeof text, err);
    if (s != STATUS_OK) return s;
    json_field_path(f, "axes", path);
    if (!axes_valid(text))
        return error_set_field(
            err, STATUS_INVALID, path,
            "'%s' is '%s': allowed is each of x, y, z once, with an optional minus sign, such as 'xyz' or '-zxy'", path,
            text);
    memcpy(doc->axes, text, sizeof text);
    return STATUS_OK;
}

static status parse_matrix(const struct json_field *f, struct job_document *doc, struct error *err)
{
    double *m = doc->matrix;
    status s = json_field_number_array(f, "matrix", 9, -1000.0, 1000.0, m, err);
    if (s != STATUS_OK) return s;
    double det =
        m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
    if (fabs(det) < 1e-6)
        return error_set_field(err, STATUS_INVALID, "volume.matrix",
                               "'volume.matrix' has determinant %g: it must be invertible", det);
    return STATUS_OK;
}

static status parse_crop_voxel(const struct json_field *f, struct job_document *doc, struct error *err)
{
    size_t *c = doc->crop_voxel;
    status s = json_field_size_array(f, "crop_voxel", 6, 1u << 20, c, err);
    if (s != STATUS_OK) return s;
    bool given = json_object_get(f->object, "crop_voxel") != NULL;
    for (size_t a = 0; given && a < 3; a++)
        if (c[a + 3] <= c[a])
            return error_set_field(
                err, STATUS_INVALID, "volume.crop_voxel",
                "'volume.crop_voxel' is empty along %c: the order is x0, y0, z0, x1, y1, z1 with x0 < x1", "xyz"[a]);
    return STATUS_OK;
}

/* Samples without a header: shape and type are required, and the byte order where a sample has several bytes. */
static status parse_raw(const struct json_field *f, struct job_document *doc, struct error *err)
{
    static const char *const key[] = {"shape", "type", "endian", "header_bytes", NULL};
    static const char *const type[] = {"uint8", "int8",    "uint16",  "int16", "uint32",
                                       "int32", "float32", "float64", NULL};
    static const char *const endian[] = {"little", "big", NULL};
    struct json_field raw;
    bool present;
    size_t i_type = 0, i_endian = 0;
    status s = json_field_object(f, "raw", &raw, &present, err);
    if (s != STATUS_OK || !present) return s;
    s = json_field_check_keys(&raw, key, err);
    static const char *const required[] = {"shape", "type"};
    for (size_t i = 0; i < 2 && s == STATUS_OK; i++)
        if (json_object_get(raw.object, required[i]) == NULL)
            s = error_set_field(err, STATUS_INVALID, "volume.raw", "'volume.raw' lacks '%s'", required[i]);
    if (s == STATUS_OK) s = json_field_size_array(&raw, "shape", 3, 1u << 20, doc->raw_shape, err);
    for (size_t a = 0; a < 3 && s == STATUS_OK; a++)
        if (doc->raw_shape[a] == 0)
            s = error_set_field(err, STATUS_INVALID, "volume.raw.shape",
                                "'volume.raw.shape' must be three numbers of voxels from 1");
    if (s == STATUS_OK) s = json_field_choice(&raw, "type", type, &i_type, err);
    if (s == STATUS_OK) s = json_field_choice(&raw, "endian", endian, &i_endian, err);
    if (s == STATUS_OK) s = json_field_size(&raw, "header_bytes", 0, 1u << 30, &doc->raw_header_bytes, err);
    if (s == STATUS_OK && i_type > 1 && json_object_get(raw.object, "endian") == NULL)
        s = error_set_field(err, STATUS_INVALID, "volume.raw", "'volume.raw' lacks 'endian': 'little' or 'big'");
    if (s == STATUS_OK && doc->n_volume_file != 1)
        s = error_set_field(err, STATUS_INVALID, "volume.raw",
                            "'volume.raw' describes one file, 'volume.files' names %zu", doc->n_volume_file);
    if (s != STATUS_OK) return s;
    snprintf(doc->raw_type, sizeof doc->raw_type, "%s", type[i_type]);
    doc->raw_big_endian = i_endian == 1;
    return STATUS_OK;
}

static status parse_filter(const struct json_field *f, struct job_document *doc, struct error *err)
{
    static const char *const key[] = {"s", "t", "h", "eps_d", "eps_J", NULL};
    struct json_field filter;
    bool present;
    status s = json_field_object(f, "filter", &filter, &present, err);
    if (s != STATUS_OK || !present) return s;
    s = json_field_check_keys(&filter, key, err);
    if (s == STATUS_OK) s = json_field_number(&filter, "s", 1e-4, 100.0, &doc->filter_s, err);
    if (s == STATUS_OK) s = json_field_number(&filter, "t", 1e-4, 100.0, &doc->filter_t, err);
    if (s == STATUS_OK) s = json_field_size(&filter, "h", 3, 63, &doc->filter_h, err);
    if (s == STATUS_OK) s = json_field_number(&filter, "eps_d", 0.0, 1.0, &doc->filter_eps_d, err);
    if (s == STATUS_OK) s = json_field_number(&filter, "eps_J", -1e6, 0.0, &doc->filter_eps_j, err);
    if (s == STATUS_OK && doc->filter_t <= 0.5 * doc->filter_s) /* false where one is NaN: left to the data */
        s = error_set_field(
            err, STATUS_INVALID, "volume.filter.t",
            "'volume.filter.t' is %g: it must be above half of s (%g), or no direction answers to fibers",
            doc->filter_t, doc->filter_s);
    return s;
}

/* What is chosen from the data. A matrix or a box that is given wins, so that a job can be repeated with the values of its result. */
static status parse_alignment(const struct json_field *f, struct job_document *doc, struct error *err)
{
    static const char *const choice[] = {"none", "auto", NULL};
    size_t align = 0, crop = 0;
    status s = json_field_choice(f, "align", choice, &align, err);
    if (s == STATUS_OK) s = json_field_choice(f, "crop", choice, &crop, err);
    if (s == STATUS_OK) s = json_field_number(f, "crop_keep", 0.1, 1.0, &doc->crop_keep, err);
    if (s == STATUS_OK) s = json_field_bool(f, "join_seams", &doc->join_seams, err);
    doc->align = align == 1 && json_object_get(f->object, "matrix") == NULL;
    doc->crop = crop == 1 && json_object_get(f->object, "crop_voxel") == NULL;
    return s;
}

status job_parse_volume(const struct json_field *f, struct job_document *doc, struct error *err)
{
    static const char *const key[] = {"files",
                                      "raw",
                                      "voxel_size_um",
                                      "axes",
                                      "matrix",
                                      "crop_voxel",
                                      "density_low",
                                      "density_high",
                                      "filter",
                                      "link_sigma_voxel",
                                      "min_vertices",
                                      "radius_um",
                                      "radius_per_axis",
                                      "align",
                                      "crop",
                                      "crop_keep",
                                      "join_seams",
                                      NULL};
    status s = json_field_check_keys(f, key, err);
    if (s == STATUS_OK) s = parse_files(f, doc, err);
    if (s == STATUS_OK) s = parse_raw(f, doc, err);
    if (s == STATUS_OK) s = parse_voxel_size(f, doc, err);
    if (s == STATUS_OK) s = parse_axes(f, doc, err);
    if (s == STATUS_OK) s = parse_matrix(f, doc, err);
    if (s == STATUS_OK) s = parse_crop_voxel(f, doc, err);
    if (s == STATUS_OK) s = parse_alignment(f, doc, err);
    if (s == STATUS_OK) s = json_field_number(f, "density_low", -1e9, 1e9, &doc->density_low, err);
    if (s == STATUS_OK) s = json_field_number(f, "density_high", -1e9, 1e9, &doc->density_high, err);
    if (s == STATUS_OK && doc->density_low >= doc->density_high)
        s = error_set_field(err, STATUS_INVALID, "volume.density_high",
                            "'volume.density_high' (%g) must be above density_low (%g)", doc->density_high,
                            doc->density_low);
    if (s == STATUS_OK) s = parse_filter(f, doc, err);
    if (s == STATUS_OK) s = json_field_number(f, "link_sigma_voxel", 0.1, 100.0, &doc->link_sigma_voxel, err);
    if (s == STATUS_OK) s = json_field_size(f, "min_vertices", 2, 100000, &doc->min_vertex, err);
    if (s == STATUS_OK) s = json_field_number(f, "radius_um", 0.05, 1000.0, &doc->radius_um, err);
    bool per_axis = false;
    if (s == STATUS_OK) s = json_field_bool(f, "radius_per_axis", &per_axis, err);
    if (json_object_get(f->object, "radius_per_axis") != NULL) doc->radius_per_axis = per_axis;
    return s;
}

status job_parse_fibers(const struct json_field *f, struct job_document *doc, struct error *err)
{
    static const char *const key[] = {"file", "tile_mm", "voxel_um", NULL};
    status s = json_field_check_keys(f, key, err);
    if (s == STATUS_OK) s = job_parse_file_name(f, "file", doc->fiber_file, err);
    if (s == STATUS_OK) s = json_field_number_array(f, "tile_mm", 2, 0.01, 10000.0, doc->tile_mm, err);
    if (s == STATUS_OK) s = json_field_number(f, "voxel_um", 0.05, 1000.0, &doc->voxel_um, err);
    return s;
}

/* ---- photographs ---- */

/* Behind the cloth the lamp lights it through; that needs a cloth without its black sheet. */
status job_parse_light_theta(const struct json_field *f, const struct job_document *doc, double *theta_deg,
                             struct error *err)
{
    char path[JSON_PATH_BYTES];
    json_field_path(f, "light_theta_deg", path);
    status s = json_field_required_number(f, "light_theta_deg", 0.0, 180.0, theta_deg, err);
    if (s != STATUS_OK) return s;
    if (*theta_deg == 90.0 || (*theta_deg > 90.0 && doc->black_sheet))
        return error_set_field(err, STATUS_INVALID, path,
                               "'%s' is %g: allowed are 0 to below 90 degrees from the normal (above 90, from behind, "
                               "without black_sheet)",
                               path, *theta_deg);
    return STATUS_OK;
}

static status parse_photograph(const struct json_field *f, const struct job_document *doc, struct job_photograph *p,
                               struct error *err)
{
    static const char *const key[] = {"file",
                                      "set",
                                      "light_theta_deg",
                                      "light_phi_deg",
                                      "camera_theta_deg",
                                      "camera_phi_deg",
                                      "cloth_rotation_deg",
                                      "scale",
                                      "weight",
                                      "crop_px",
                                      "transfer",
                                      NULL};
    static const char *const set_name[] = {"fit", "held-out", NULL};
    static const char *const transfer[] = {"linear", "srgb", NULL};
    char path[JSON_PATH_BYTES];
    size_t set = JOB_SET_FIT, srgb = 0;
    p->scale = p->weight = 1.0;
    status s = json_field_check_keys(f, key, err);
    if (s == STATUS_OK) s = job_parse_file_name(f, "file", p->file, err);
    if (s == STATUS_OK) s = json_field_choice(f, "set", set_name, &set, err);
    if (s == STATUS_OK) s = job_parse_light_theta(f, doc, &p->light_theta_deg, err);
    if (s == STATUS_OK) s = json_field_required_number(f, "light_phi_deg", -360.0, 360.0, &p->light_phi_deg, err);
    if (s == STATUS_OK) s = json_field_required_number(f, "camera_theta_deg", 0.0, 89.999, &p->camera_theta_deg, err);
    if (s == STATUS_OK) s = json_field_required_number(f, "camera_phi_deg", -360.0, 360.0, &p->camera_phi_deg, err);
    if (s == STATUS_OK) s = json_field_number(f, "cloth_rotation_deg", -360.0, 360.0, &p->cloth_rotation_deg, err);
    if (s == STATUS_OK) s = json_field_number(f, "scale", 1e-9, 1e9, &p->scale, err);
    if (s == STATUS_OK) s = json_field_number(f, "weight", 0.0, 1e6, &p->weight, err);
    if (s == STATUS_OK) s = json_field_size_array(f, "crop_px", 4, 1u << 20, p->crop_px, err);
    if (s == STATUS_OK) s = json_field_choice(f, "transfer", transfer, &srgb, err);
    if (s != STATUS_OK) return s;
    json_field_path(f, "crop_px", path);
    if (json_object_get(f->object, "crop_px") != NULL &&
        (p->crop_px[2] <= p->crop_px[0] || p->crop_px[3] <= p->crop_px[1]))
        return error_set_field(err, STATUS_INVALID, path,
                               "'%s' is empty: the order is x0, y0, x1, y1 with x0 < x1 and y0 < y1", path);
    p->set = (enum job_set)set;
    p->srgb = srgb == 1;
    return STATUS_OK;
}

status job_parse_photographs(const struct json_field *root, struct job_document *doc, struct error *err)
{
    const json_t *list = json_object_get(root->object, "photographs");
    if (!json_is_array(list) || json_array_size(list) == 0 || json_array_size(list) > JOB_MAX_PHOTOGRAPH)
        return error_set_field(err, STATUS_INVALID, "photographs",
                               "'photographs' must be a list of 1 to %d photographs", JOB_MAX_PHOTOGRAPH);
    size_t n = json_array_size(list), n_fit = 0;
    doc->photograph = calloc(n, sizeof *doc->photograph);
    if (doc->photograph == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    for (size_t i = 0; i < n; i++) {
        struct json_field f = {.object = json_array_get(list, i)};
        snprintf(f.path, sizeof f.path, "photographs[%zu]", i);
        status s = parse_photograph(&f, doc, &doc->photograph[i], err);
        if (s != STATUS_OK) return s;
        doc->n_photograph++;
        if (doc->photograph[i].set == JOB_SET_FIT) n_fit++;
    }
    if (n_fit == 0)
        return error_set_field(err, STATUS_INVALID, "photographs",
                               "'photographs' has no photograph with \"set\": \"fit\": give at least one");
    return STATUS_OK;
}
