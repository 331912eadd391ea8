/* Files of goniometers in the style of ASTM E1392, as Cornell's Program of Computer Graphics publishes them. Lines
 * of the header begin with a keyword. The line "VARS theta_i,phi_i,theta_s,phi_s,..." names the columns: after the
 * four angles R,G,B or X,Y,Z (D65), or wavelengths as "400nm", or a single one that counts for all channels. A row
 * of numbers for each measurement follows: BRDF per steradian. Angles point from the sample to source and
 * detector, the polar ones from the normal; they are radians, unless a polar angle is above pi / 2 + 0.1: then all
 * are degrees. Rows beyond 90 degrees are transmission and are left out; values below 0, which noise gives, count
 * as 0.
 *
 * A file whose source has one azimuth counts as isotropic, another one as anisotropic, unless the job says which. */
#include "base/angle.h"
#include "base/files/durable.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/rows/brdf_file.h"
#include "optimizer/photographs/rows/brdf_samples.h"
#include "optimizer/photographs/rows/brdf_spectrum.h"
#include "optimizer/photographs/rows/table_text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { MAX_BYTES = 1 << 28, MAX_COLUMN = 1028, N_ANGLE = 4, N_CHOSEN = BRDF_FIT_ROWS + BRDF_HELD_OUT_ROWS };
static const double largest_radians = M_PI_2 + 0.1;

struct astm {
    struct brdf_samples sample;
    size_t n_chosen, chosen[N_CHOSEN];
};

/* The meaning of the columns after the angles: rgb is the sum of weight_rgb times value. */
struct astm_columns {
    size_t n;
    double (*weight_rgb)[3];
};

struct astm_row {
    double angle[N_ANGLE], rgb[3];
};

struct astm_rows {
    size_t n, room;
    struct astm_row *item;
};

static status fault_at(const char *name, size_t i_line, struct error *err, const char *what)
{
    return error_set(err, STATUS_FORMAT, "cannot read measured BRDF '%s', line %zu: %s", name, i_line, what);
}

static bool names_are(char **cell, const char *a, const char *b, const char *c)
{
    return strcasecmp(cell[0], a) == 0 && strcasecmp(cell[1], b) == 0 && strcasecmp(cell[2], c) == 0;
}

/* Wavelengths in the names of the columns. */
static bool spectral_weights(char **cell, size_t n, double (*weight)[3])
{
    double nm[MAX_COLUMN];
    for (size_t i = 0; i < n; i++) {
        char *end;
        nm[i] = strtod(cell[i], &end);
        if (end == cell[i] || strcasecmp(end, "nm") != 0) return false;
    }
    return brdf_spectrum_weights(nm, n, weight);
}

static status parse_columns(char *text, const char *name, size_t i_line, struct astm_columns *k, struct error *err)
{
    char *cell[MAX_COLUMN];
    size_t n = table_text_split(text, ',', cell, MAX_COLUMN);
    if (n > MAX_COLUMN) return fault_at(name, i_line, err, "it has more than 1028 columns");
    if (n < N_ANGLE + 1 || strcasecmp(cell[0], "theta_i") != 0 || strcasecmp(cell[1], "phi_i") != 0 ||
        strcasecmp(cell[2], "theta_s") != 0 || strcasecmp(cell[3], "phi_s") != 0)
        return fault_at(name, i_line, err, "its columns do not begin with theta_i, phi_i, theta_s, phi_s and a value");
    k->n = n - N_ANGLE;
    k->weight_rgb = calloc(k->n, sizeof *k->weight_rgb);
    if (k->weight_rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", name);
    char **value = cell + N_ANGLE;
    bool rgb = k->n == 3 && (names_are(value, "R", "G", "B") || names_are(value, "red", "green", "blue"));
    bool xyz = k->n == 3 && names_are(value, "X", "Y", "Z");
    if (k->n == 1)
        for (size_t c = 0; c < 3; c++) k->weight_rgb[0][c] = 1.0;
    for (size_t i = 0; i < 3 && (rgb || xyz); i++) {
        double unit[3] = {i == 0, i == 1, i == 2};
        if (rgb) memcpy(k->weight_rgb[i], unit, sizeof unit);
        if (xyz) brdf_rgb_of_xyz(unit, k->weight_rgb[i]);
    }
    if (k->n > 1 && !rgb && !xyz && !spectral_weights(value, k->n, k->weight_rgb))
        return fault_at(name, i_line, err,
                        "its columns are neither R,G,B nor X,Y,Z nor rising wavelengths as 400nm from 400 to 700 nm");
    return STATUS_OK;
}

static status parse_row(char *text, const char *name, size_t i_line, const struct astm_columns *k,
                        struct astm_rows *rows, struct error *err)
{
    char *cell[MAX_COLUMN];
    struct astm_row row = {.rgb = {0}};
    size_t n = table_text_split(text, ',', cell, MAX_COLUMN);
    if (n == N_ANGLE + k->n + 1 && cell[n - 1][0] == '\0') n--;
    if (n != N_ANGLE + k->n) return fault_at(name, i_line, err, "it has another number of values than VARS names");
    for (size_t i = 0; i < n; i++) {
        double value;
        if (!table_text_number(cell[i], &value) || !(fabs(value) < 1e9))
            return fault_at(name, i_line, err, "it has a value that is not a number");
        if (i < N_ANGLE) row.angle[i] = value;
        for (size_t c = 0; i >= N_ANGLE && c < 3; c++) row.rgb[c] += k->weight_rgb[i - N_ANGLE][c] * value;
    }
    if (rows->n == rows->room) {
        size_t room = 2 * rows->room + 1024;
        struct astm_row *more = realloc(rows->item, room * sizeof *more);
        if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", name);
        rows->item = more;
        rows->room = room;
    }
    rows->item[rows->n++] = row;
    return STATUS_OK;
}

static status parse(char *text, const char *name, struct astm_rows *rows, struct error *err)
{
    struct astm_columns columns = {0};
    status s = STATUS_OK;
    size_t i_line = 0;
    for (char *line = table_text_begin(text), *next; s == STATUS_OK && line != NULL; line = next) {
        next = strchr(line, '\n');
        if (next != NULL) *next++ = '\0';
        i_line++;
        line += strspn(line, " \t\r");
        if (columns.n == 0 && strncmp(line, "VARS", 4) == 0 && (line[4] == ' ' || line[4] == '\t'))
            s = parse_columns(line + 5, name, i_line, &columns, err);
        else if (columns.n > 0 && *line != '\0' && strncmp(line, "NUM_POINTS", 10) != 0)
            s = parse_row(line, name, i_line, &columns, rows, err);
    }
    if (s == STATUS_OK && columns.n == 0)
        s = error_set(err, STATUS_FORMAT,
                      "cannot read measured BRDF '%s': it has no line \"VARS theta_i,phi_i,theta_s,phi_s,...\"", name);
    free(columns.weight_rgb);
    return s;
}

static void unit_vector(double theta, double phi, double v[3])
{
    v[0] = sin(theta) * cos(phi);
    v[1] = sin(theta) * sin(phi);
    v[2] = cos(theta);
}

/* The rows above the cloth as samples. Whether the source has one azimuth only goes to *one_azimuth. */
static status make_samples(const struct astm_rows *rows, const char *name, struct brdf_samples *out, bool *one_azimuth,
                           struct error *err)
{
    double largest = 0.0, sine[2] = {1.0, -1.0};
    for (size_t i = 0; i < rows->n; i++)
        largest = fmax(largest, fmax(fabs(rows->item[i].angle[0]), fabs(rows->item[i].angle[2])));
    double unit = largest > largest_radians ? M_PI / 180.0 : 1.0, first[3] = {0};
    out->item = malloc((rows->n + 1) * sizeof *out->item);
    if (out->item == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", name);
    for (size_t i = 0; i < rows->n; i++) {
        const struct astm_row *r = &rows->item[i];
        struct brdf_sample *p = &out->item[out->n];
        unit_vector(unit * r->angle[0], unit * r->angle[1], p->light);
        unit_vector(unit * r->angle[2], unit * r->angle[3], p->camera);
        for (size_t c = 0; c < 3; c++) p->f_rgb[c] = fmax(r->rgb[c], 0.0);
        if (p->light[2] < 1e-3 || p->camera[2] < 1e-3) continue;
        out->n++;
        double length = hypot(p->light[0], p->light[1]);
        if (length < 0.02) continue; /* near the normal an azimuth says nothing */
        if (first[2] <= 0.0) {
            first[0] = p->light[0] / length;
            first[1] = p->light[1] / length;
            first[2] = 1.0;
        }
        double across = (first[0] * p->light[1] - first[1] * p->light[0]) / length;
        sine[0] = fmin(sine[0], across);
        sine[1] = fmax(sine[1], across);
        if (first[0] * p->light[0] + first[1] * p->light[1] < 0.0) sine[1] = 1.0;
    }
    *one_azimuth = sine[1] - sine[0] < 0.01 || sine[1] < sine[0];
    if (out->n > 0) return STATUS_OK;
    return error_set(err, STATUS_FORMAT, "cannot read measured BRDF '%s': it has no row of light that is reflected",
                     name);
}

static void close_astm(void *handle)
{
    struct astm *a = handle;
    free(a->sample.item);
    free(a);
}

static status open_astm(const char *path, enum job_symmetry symmetry, void **handle, struct error *err)
{
    const char *name = path_file_name(path);
    char *text = NULL;
    bool one_azimuth = false;
    struct astm_rows rows = {0};
    struct astm *a = calloc(1, sizeof *a);
    if (a == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read measured BRDF '%s': out of memory", name);
    status s = file_read_all(path, MAX_BYTES, &text, NULL, err);
    if (s == STATUS_OK) s = parse(text, name, &rows, err);
    if (s == STATUS_OK) s = make_samples(&rows, name, &a->sample, &one_azimuth, err);
    free(text);
    free(rows.item);
    if (s != STATUS_OK) {
        close_astm(a);
        return s;
    }
    a->sample.isotropic = symmetry == JOB_SYMMETRY_FILE ? one_azimuth : symmetry == JOB_SYMMETRY_ISOTROPIC;
    brdf_samples_sort(&a->sample);
    struct brdf_sample first = {.f_rgb = {0}};
    unit_vector(M_PI / 9.0, 0.0, first.light);
    unit_vector(M_PI / 9.0, M_PI, first.camera);
    a->n_chosen = brdf_samples_spread(&a->sample, &first, N_CHOSEN, a->chosen);
    *handle = a;
    return STATUS_OK;
}

static bool isotropic_astm(const void *handle) { return ((const struct astm *)handle)->sample.isotropic; }

static bool eval_astm(const void *handle, const double light[3], const double camera[3], double f_rgb[3])
{
    return brdf_samples_value(&((const struct astm *)handle)->sample, light, camera, f_rgb);
}

static double degrees(double rad) { return rint(rad * 180.0 / M_PI * 1e6) * 1e-6; }

static bool measured_astm(const void *handle, size_t i, struct job_measured_row *row)
{
    const struct astm *a = handle;
    if (i >= a->n_chosen) return false;
    const struct brdf_sample *p = &a->sample.item[a->chosen[i]];
    row->light_theta_deg = degrees(acos(fmin(p->light[2], 1.0)));
    row->light_phi_deg = degrees(atan2(p->light[1], p->light[0]));
    row->camera_theta_deg = degrees(acos(fmin(p->camera[2], 1.0)));
    row->camera_phi_deg = degrees(atan2(p->camera[1], p->camera[0]));
    return true;
}

const brdf_reader astm_brdf_reader = {.id = "astm_e1392.v1",
                                      .title = "ASTM E1392",
                                      .suffix = ".astm",
                                      .open = open_astm,
                                      .isotropic = isotropic_astm,
                                      .eval = eval_astm,
                                      .measured = measured_astm,
                                      .close = close_astm};
