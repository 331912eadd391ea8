#include "optimizer/photographs/rows/brdf_file.h"

#include "base/angle.h"
#include "base/files/durable.h"
#include "base/files/reading_note.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_rows.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { LAMP_SAMPLES = 8 };

#define READER_ADDRESS(name) &name,
static const brdf_reader *const reader[] = {BRDF_READERS(READER_ADDRESS)};

/* light theta, camera theta, camera phi; the lamp is at phi 0. */
static const double fit_deg[BRDF_FIT_ROWS][3] = {
    {20, 20, 180}, {45, 45, 180}, {60, 60, 180}, {75, 75, 180}, {45, 75, 180}, {75, 45, 180},
    {60, 0, 180},  {0, 60, 0},    {70, 70, 150}, {60, 60, 135}, {70, 40, 150}, {45, 45, 90},
    {64, 64, 90},  {40, 40, 45},  {70, 50, 30},  {60, 20, 20},
};
static const double held_light_deg[4] = {10, 30, 50, 65}, held_camera_deg[3] = {5, 30, 55}, held_phi_deg[2] = {180, 75};

const brdf_reader *brdf_reader_of_name(const char *name)
{
    size_t n = strlen(name);
    for (size_t i = 0; i < sizeof reader / sizeof *reader; i++) {
        size_t k = strlen(reader[i]->suffix);
        if (n > k && strcasecmp(name + n - k, reader[i]->suffix) == 0) return reader[i];
    }
    return NULL;
}

static void direction(double theta_rad, double phi_rad, double out[3])
{
    out[0] = sin(theta_rad) * cos(phi_rad);
    out[1] = sin(theta_rad) * sin(phi_rad);
    out[2] = cos(theta_rad);
}

/* Turns a direction about the normal: into the frame of a cloth that is turned by angle_rad. */
static void into_cloth(double angle_rad, double v[3])
{
    double x = v[0] * cos(angle_rad) + v[1] * sin(angle_rad), y = v[1] * cos(angle_rad) - v[0] * sin(angle_rad);
    v[0] = x;
    v[1] = y;
}

/* Place i of the lamp: unit direction to it, and its weight cos(lamp) / distance^2 relative to the middle. */
static double lamp_sample(const struct configuration *k, size_t i, double to_lamp[3])
{
    double middle[3], across[3], along[3], length2 = 0.0, facing = 0.0, p[3];
    direction(k->light_theta_rad, k->light_phi_rad, middle);
    direction(k->light_theta_rad + M_PI_2, k->light_phi_rad, across);
    direction(M_PI_2, k->light_phi_rad + M_PI_2, along);
    double half = k->light == LIGHT_DIRECTIONAL ? 0.0 : 0.5 * k->lamp_side_m / k->light_distance_m;
    double u = half * (2.0 * ((double)(i % LAMP_SAMPLES) + 0.5) / LAMP_SAMPLES - 1.0);
    double v = half * (2.0 * ((double)(i / LAMP_SAMPLES) + 0.5) / LAMP_SAMPLES - 1.0);
    for (int c = 0; c < 3; c++) {
        p[c] = middle[c] + u * across[c] + v * along[c];
        length2 += p[c] * p[c];
    }
    for (int c = 0; c < 3; c++) {
        to_lamp[c] = p[c] / sqrt(length2);
        facing += to_lamp[c] * middle[c];
    }
    return facing / length2;
}

/* The radiance of a configuration; false where nothing was measured. */
static bool radiance(const brdf_reader *r, const void *handle, const struct configuration *k, double rgb[3])
{
    double white = 0.0, camera[3];
    direction(k->camera_theta_rad, k->camera_phi_rad, camera);
    into_cloth(k->cloth_rotation_rad, camera);
    memset(rgb, 0, 3 * sizeof *rgb);
    for (size_t i = 0; i < LAMP_SAMPLES * LAMP_SAMPLES; i++) {
        double light[3], middle[3], f[3], facing = 0.0;
        double weight = lamp_sample(k, i, light);
        direction(k->light_theta_rad, k->light_phi_rad, middle);
        for (int c = 0; c < 3; c++) facing += middle[c] * light[c];
        white += weight * facing;
        if (light[2] <= 0.0) continue;
        into_cloth(k->cloth_rotation_rad, light);
        if (!r->eval(handle, light, camera, f)) return false;
        for (int c = 0; c < 3; c++) rgb[c] += M_PI * f[c] * light[2] * weight;
    }
    for (int c = 0; c < 3; c++) rgb[c] /= white;
    return true;
}

/* An open file of a measured BRDF, and the receiver of its rows. */
struct brdf_source {
    const brdf_reader *reader;
    const void *handle;
    const char *name;
    const struct job_setup *setup;
    bool asked; /* the job names the configurations */
    const struct warning_sink *warn;
    struct observation_set *rows;
};

static status add_row(const struct brdf_source *s, const struct job_measured_row *row, struct error *err)
{
    struct observation item = {.set = row->set, .weight = 1.0};
    item.configuration = observation_configuration(s->setup, row->light_theta_deg, row->light_phi_deg,
                                                   row->camera_theta_deg, row->camera_phi_deg, row->cloth_rotation_deg);
    if (radiance(s->reader, s->handle, &item.configuration, item.mean_rgb)) {
        item.configuration.n_rotation = s->reader->isotropic(s->handle) ? CONFIGURATION_ALL_ROTATIONS : 0;
        if (s->reader->isotropic(s->handle)) item.configuration.cloth_rotation_rad = 0.0;
        snprintf(item.name, sizeof item.name, "%s-%02zu", row->set == JOB_SET_FIT ? "fit" : "held-out",
                 observation_set_count(s->rows, row->set));
        return observation_set_append(s->rows, &item, err);
    }
    char text[300];
    snprintf(text, sizeof text,
             "measured BRDF '%s' has no value for the lamp at (%g, %g) and the camera at (%g, %g) degrees", s->name,
             row->light_theta_deg, row->light_phi_deg, row->camera_theta_deg, row->camera_phi_deg);
    if (row->set == JOB_SET_FIT && s->asked)
        return error_set_field(err, STATUS_INVALID, OPTION_MEASUREMENT_FILE, "%s", text);
    warning_send(s->warn, OPTION_MEASUREMENT_FILE, "%s: the %s row is left out", text,
                 row->set == JOB_SET_FIT ? "fitted" : "held-out");
    return STATUS_OK;
}

static status add_default_rows(const struct brdf_source *source, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i < BRDF_FIT_ROWS && s == STATUS_OK; i++) {
        const struct job_measured_row row = {.set = JOB_SET_FIT,
                                             .light_theta_deg = fit_deg[i][0],
                                             .camera_theta_deg = fit_deg[i][1],
                                             .camera_phi_deg = fit_deg[i][2],
                                             .cloth_rotation_deg = i % 2 == 0 ? 0.0 : 90.0};
        s = add_row(source, &row, err);
    }
    for (size_t i = 0; i < BRDF_HELD_OUT_ROWS && s == STATUS_OK; i++) {
        const struct job_measured_row row = {.set = JOB_SET_HELD_OUT,
                                             .light_theta_deg = held_light_deg[i / 6],
                                             .camera_theta_deg = held_camera_deg[i / 2 % 3],
                                             .camera_phi_deg = held_phi_deg[i % 2],
                                             .cloth_rotation_deg = i % 4 < 2 ? 0.0 : 90.0};
        s = add_row(source, &row, err);
    }
    return s;
}

static status add_measured_rows(const struct brdf_source *source, struct error *err)
{
    status s = STATUS_OK;
    struct job_measured_row row = {.set = JOB_SET_FIT};
    for (size_t i = 0; s == STATUS_OK && source->reader->measured(source->handle, i, &row); i++) {
        row.set = i % 5 == 0 || i % 5 == 2 ? JOB_SET_FIT : JOB_SET_HELD_OUT;
        s = add_row(source, &row, err);
    }
    return s;
}

static status add_rows(const struct brdf_source *source, const struct job_rows *asked, struct error *err)
{
    status s = STATUS_OK;
    if (asked->n_measured_row == 0 && source->reader->measured != NULL) return add_measured_rows(source, err);
    if (asked->n_measured_row == 0) return add_default_rows(source, err);
    for (size_t i = 0; i < asked->n_measured_row && s == STATUS_OK; i++)
        s = add_row(source, &asked->measured_row[i], err);
    return s;
}

status brdf_file_read(const brdf_reader *r, const char *path, const struct job_setup *setup,
                      const struct job_rows *rows, const struct warning_sink *warn, struct observation_set *o,
                      struct error *err)
{
    void *handle = NULL;
    const char *name = path_file_name(path);
    reading_note_set(r->title, path);
    status s = r->open(path, rows->measurement_symmetry, &handle, err);
    reading_note_set(NULL, NULL);
    if (s != STATUS_OK) {
        if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_MEASUREMENT_FILE);
        return s;
    }
    const struct brdf_source source = {r, handle, name, setup, rows->n_measured_row > 0, warn, o};
    s = add_rows(&source, rows, err);
    r->close(handle);
    if (s == STATUS_OK && observation_set_count(o, JOB_SET_FIT) == 0)
        return error_set_field(err, STATUS_INVALID, OPTION_MEASUREMENT_FILE,
                               "measured BRDF '%s' has no value for any row to fit", name);
    return s;
}
