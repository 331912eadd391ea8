/* Checks of the sections "volume" and its parts. */
#include "optimizer/job/checks/job_document_parts.h"
#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_scan.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A value that the document gives replaces one that is chosen from the data. A job can therefore be repeated with the
 * values of its result. */
status job_check_volume(const struct option_value *v, struct error *err)
{
    struct job_scan *scan = v->own;
    if (json_object_get(v->value, "matrix") != NULL) scan->align = false;
    if (json_object_get(v->value, "crop_voxel") != NULL) scan->crop = false;
    if (scan->density_low >= scan->density_high) /* false where one is NaN */
        return error_set_field(err, STATUS_INVALID, "volume.density_high",
                               "'volume.density_high' (%g) must be above density_low (%g)", scan->density_high,
                               scan->density_low);
    if (json_object_get(v->value, "raw") != NULL && scan->n_file != 1)
        return error_set_field(err, STATUS_INVALID, "volume.raw",
                               "'volume.raw' describes one file, 'volume.files' names %zu", scan->n_file);
    return STATUS_OK;
}

/* Samples of several bytes have a byte order. */
status job_check_raw(const struct option_value *v, struct error *err)
{
    const char *type = v->section->scan->raw_type;
    bool one_byte = type[0] != '\0' && type[strlen(type) - 1] == '8';
    if (one_byte || json_object_get(v->value, "endian") != NULL) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path, "'%s' lacks 'endian': 'little' or 'big'", v->path);
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

status job_check_axes(const struct option_value *v, struct error *err)
{
    if (axes_valid(v->section->scan->axes)) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, v->path,
        "'%s' is '%s': allowed is each of x, y, z once, with an optional minus sign, such as 'xyz' or '-zxy'", v->path,
        v->section->scan->axes);
}

status job_check_matrix(const struct option_value *v, struct error *err)
{
    const double *m = v->section->scan->matrix;
    double det =
        m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
    if (fabs(det) >= 1e-6) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path, "'%s' has determinant %g: it must be invertible", v->path,
                           det);
}

status job_check_crop_voxel(const struct option_value *v, struct error *err)
{
    const size_t *c = v->section->scan->crop_voxel;
    for (size_t a = 0; a < 3; a++)
        if (c[a + 3] <= c[a])
            return error_set_field(err, STATUS_INVALID, v->path,
                                   "'%s' is empty along %c: the order is x0, y0, z0, x1, y1, z1 with x0 < x1", v->path,
                                   "xyz"[a]);
    return STATUS_OK;
}

status job_check_filter(const struct option_value *v, struct error *err)
{
    const struct job_scan *scan = v->section->scan;
    if (scan->filter_t <= 0.5 * scan->filter_s) /* false where one is NaN, which means chosen from the data */
        return error_set_field(
            err, STATUS_INVALID, "volume.filter.t",
            "'volume.filter.t' is %g: it must be above half of s (%g), or the filter does not respond to fibers",
            scan->filter_t, scan->filter_s);
    return STATUS_OK;
}

static bool group_name_valid(const char *name)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    size_t n = name != NULL ? strlen(name) : 0;
    return n > 0 && n <= 20 && strspn(name, letters) == n;
}

status job_add_group(struct job_cloth *cloth, const char *name, const char *path, struct error *err)
{
    if (!group_name_valid(name))
        return error_set_field(
            err, STATUS_INVALID, path,
            "'%s' is not the name of a group of fibers: allowed are 1 to 20 characters of A-Z a-z 0-9 _ "
            "-",
            path);
    for (size_t k = 0; k < cloth->n_group; k++)
        if (strcmp(cloth->group[k], name) == 0)
            return error_set_field(err, STATUS_INVALID, path, "'%s' gives the name '%s' a second time", path, name);
    snprintf(cloth->group[cloth->n_group++], sizeof cloth->group[0], "%s", name);
    return STATUS_OK;
}

static status read_groups(const json_t *list, struct job_cloth *cloth, struct error *err)
{
    size_t n = json_array_size(list);
    status s = STATUS_OK;
    if (n < 2 || n > MODEL_MAX_SET)
        return error_set_field(err, STATUS_INVALID, "fibers.groups", "'fibers.groups' must be a list of 2 to %d names",
                               MODEL_MAX_SET);
    for (size_t i = 0; i < n && s == STATUS_OK; i++) {
        char path[JSON_PATH_BYTES];
        snprintf(path, sizeof path, "fibers.groups[%zu]", i);
        s = job_add_group(cloth, json_string_value(json_array_get(list, i)), path, err);
    }
    return s;
}

status job_check_fibers(const struct option_value *v, struct error *err)
{
    const json_t *groups = json_object_get(v->value, "groups");
    return groups != NULL ? read_groups(groups, v->own, err) : STATUS_OK;
}
