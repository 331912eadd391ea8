#include "optimizer/report/export/export_scene.h"

#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/result/result_json.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double mm = 1e3;
/* The cloth is as wide as the widest view, and light goes sideways in it by no more than so many thicknesses. */
static const double reach_thickness = 8.0;

/* ---- files ---- */

void export_path(const struct export_scene *e, const char *name, char path[WORKER_PATH_BYTES])
{
    char relative[128];
    snprintf(relative, sizeof relative, "%s/%s", e->folder, name);
    worker_folder_path(e->report->in.job->tools->folder, JOB_FOLDER_RESULTS, relative, path);
}

status export_text_open(struct export_text *t, struct error *err)
{
    *t = (struct export_text){0};
    t->file = open_memstream(&t->data, &t->n_byte);
    return t->file != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot export a scene: out of memory");
}

status export_text_close(const struct export_scene *e, struct export_text *t, const char *name, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    bool whole = ferror(t->file) == 0;
    whole = fclose(t->file) == 0 && whole;
    export_path(e, name, path);
    status s = whole ? worker_folder_replace(e->report->in.job->tools->folder, path, t->data, t->n_byte, err)
                     : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", name);
    free(t->data);
    *t = (struct export_text){0};
    return s;
}

/* ---- fibers ---- */

bool export_fiber_in(const struct export_scene *e, size_t i, size_t group)
{
    const uint8_t own = e->report->in.made->fiber.group[i];
    return film_of_group(&e->films, own) == NULL && (own == group || e->model->setup->sets.n_set == 1);
}

size_t export_n_point(const struct export_scene *e, size_t i)
{
    return e->report->in.made->fiber.first_vertex[i + 1] - e->report->in.made->fiber.first_vertex[i] + 2;
}

void export_point(const struct export_scene *e, size_t i, size_t k, double p_mm[3])
{
    const struct fiber_set *f = &e->report->in.made->fiber;
    const size_t first = f->first_vertex[i], last = f->first_vertex[i + 1] - 1, n = export_n_point(e, i);
    size_t v = k == 0 ? first : k == n - 1 ? last : first + k - 1;
    size_t mirrored = k == 0 ? first + 1 : k == n - 1 ? last - 1 : v;
    for (size_t a = 0; a < 3; a++) {
        double at = (double)f->position_m[3 * v + a], other = (double)f->position_m[3 * mirrored + a];
        p_mm[a] = mm * ((mirrored == v ? at : 2.0 * at - other) - (a == 2 ? e->z_high_m : 0.0));
    }
}

double export_point_radius_mm(const struct export_scene *e, size_t i, size_t k)
{
    const struct fiber_set *f = &e->report->in.made->fiber;
    const size_t first = f->first_vertex[i], last = f->first_vertex[i + 1] - 1, v = k == 0 ? first : first + k - 1;
    return mm * (double)fiber_radius_m(f, i, v < last ? v : last);
}

double export_radius_mm(const struct export_scene *e, size_t i)
{
    return mm * (double)e->report->in.made->fiber.radius_m[i];
}

void export_fibers_name(size_t group, const char *ending, char name[32])
{
    snprintf(name, 32, "fibers-%zu%s", group, ending);
}

status export_fibers_write(const struct export_scene *e, size_t group, const char *ending,
                           void (*print)(FILE *text, const struct export_scene *e, size_t i), struct error *err)
{
    struct export_text t;
    char name[32];
    status s = export_text_open(&t, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < e->report->in.made->fiber.n_fiber; i++)
        if (export_fiber_in(e, i, group)) print(t.file, e, i);
    export_fibers_name(group, ending, name);
    return export_text_close(e, &t, name, err);
}

/* ---- lamp, camera and rows ---- */

static void polar(double theta, double phi, double distance, double out[3])
{
    out[0] = distance * sin(theta) * cos(phi);
    out[1] = distance * sin(theta) * sin(phi);
    out[2] = distance * cos(theta);
}

/* Half of the width of cloth that all rows together need. */
static double half_width_mm(const struct export_scene *e)
{
    double most = 0.0, crop = 0.0;
    for (size_t i = 0; i < e->report->in.job->rows->observation.n; i++) {
        const struct configuration *k = &e->report->in.job->rows->observation.item[i].configuration;
        most = fmax(most, k->camera_theta_rad);
        crop = fmax(crop, k->crop_m);
    }
    return mm * (0.5 * crop / cos(most) * 1.1 + reach_thickness * (e->z_high_m - e->z_low_m));
}

/* The lamp has radiance 1 on a white diffuser that faces it (configuration.h). */
static double lamp_radiance(const struct configuration *k)
{
    double x = 0.5 * k->lamp_side_m / k->light_distance_m, y = x / sqrt(1.0 + x * x);
    return M_PI / (4.0 * y * atan(y));
}

struct export_view export_view_of(const struct export_scene *e, const struct configuration *k)
{
    struct export_view v = {.width_mm = mm * k->crop_m, .radiance = lamp_radiance(k), .irradiance = M_PI};
    double phi = k->camera_phi_rad - k->cloth_rotation_rad, distance = k->camera_distance_m;
    if (k->camera == CAMERA_FAR_FIELD) distance = 1.0;
    polar(k->light_theta_rad, k->light_phi_rad - k->cloth_rotation_rad, mm * k->light_distance_m, v.lamp_mm);
    polar(k->camera_theta_rad, phi, mm * distance, v.camera_mm);
    polar(M_PI_2 - k->camera_theta_rad, phi + M_PI, 1.0, v.up);
    v.fov_deg = 2.0 * atan(0.5 * k->crop_m / distance) * 180.0 / M_PI;
    v.near_mm = fmax(mm * distance - 2.0 * half_width_mm(e), 0.01 * mm * distance);
    return v;
}

void export_cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

void export_make_unit(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++) v[i] /= length;
}

void export_lamp_corners(const struct export_view *v, double side_mm, double corner[4][3])
{
    double n[3] = {-v->lamp_mm[0], -v->lamp_mm[1], -v->lamp_mm[2]}, h[3], w[3];
    export_make_unit(n);
    export_cross((const double[3]){0, 0, 1}, n, h);
    if (h[0] * h[0] + h[1] * h[1] < 1e-12) h[0] = 1.0;
    export_make_unit(h);
    export_cross(n, h, w);
    for (int k = 0; k < 4; k++)
        for (int a = 0; a < 3; a++)
            corner[k][a] =
                v->lamp_mm[a] + 0.5 * side_mm * ((k % 2 == 0 ? -1.0 : 1.0) * h[a] + (k < 2 ? -1.0 : 1.0) * w[a]);
}

bool export_repeats(const struct export_scene *e, int n[2])
{
    bool enough = true;
    for (int a = 0; a < 2; a++) {
        double wanted = ceil(2.0 * half_width_mm(e) / (mm * e->report->in.made->fiber.tile_size_m[a])) + 1.0;
        enough = enough && wanted <= EXPORT_MAX_REPEAT;
        n[a] = (int)fmin(wanted, EXPORT_MAX_REPEAT);
    }
    return enough;
}

void export_repeat_at(const struct export_scene *e, const int n[2], int i, int j, double at_mm[2])
{
    at_mm[0] = mm * e->report->in.made->fiber.tile_size_m[0] * (i - 0.5 * n[0]);
    at_mm[1] = mm * e->report->in.made->fiber.tile_size_m[1] * (j - 0.5 * n[1]);
}

bool export_sheet(const struct export_scene *e, double half_mm[2], double *z_mm)
{
    int n[2];
    export_repeats(e, n);
    for (int a = 0; a < 2; a++) half_mm[a] = mm * e->report->in.made->fiber.tile_size_m[a] * n[a];
    *z_mm = mm * (e->z_low_m - e->z_high_m) - 1e-3;
    return e->report->in.job->setup->black_sheet;
}

static void print_three(FILE *text, const double v[3], const char *end)
{
    fprintf(text, "%.9g,%.9g,%.9g%s", v[0], v[1], v[2], end);
}

status export_rows_write(const struct export_scene *e, struct error *err)
{
    const struct observation_set *o = &e->report->in.job->rows->observation;
    struct export_text t;
    status s = export_text_open(&t, err);
    if (s != STATUS_OK) return s;
    fprintf(t.file, "row,set,rotations,lamp_x_mm,lamp_y_mm,lamp_z_mm,camera_x_mm,camera_y_mm,camera_z_mm,up_x,up_y,"
                    "up_z,measured_r,measured_g,measured_b,rendered_r,rendered_g,rendered_b\n");
    for (size_t i = 0; i < o->n; i++) {
        const struct observation *row = &o->item[i];
        const struct export_view v = export_view_of(e, &row->configuration);
        double rendered[3], se[3];
        result_rendered_mean(e->model, i, rendered, se);
        fprintf(t.file, "%zu,%s,%u,", i, row->set == JOB_SET_FIT ? "fit" : "held-out",
                row->configuration.n_rotation > 1 ? row->configuration.n_rotation : 1);
        print_three(t.file, v.lamp_mm, ",");
        print_three(t.file, v.camera_mm, ",");
        print_three(t.file, v.up, ",");
        print_three(t.file, row->mean_rgb, ",");
        print_three(t.file, rendered, "\n");
    }
    return export_text_close(e, &t, "rows.csv", err);
}

/* ---- entries of result.json ---- */

json_t *export_material_json(const struct export_scene *e, size_t group, json_t *material)
{
    json_object_set_new(material, "group",
                        e->model->setup->sets.n_set > 1 ? json_string(e->report->in.job->cloth->group[group])
                                                        : json_null());
    return material;
}

static json_t *lobes_json(const struct hair_lobes *l, double share)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:o}", "share", json_number(share), "longitudinal_roughness",
                     json_number(l->longitudinal_roughness), "azimuthal_roughness", json_number(l->azimuthal_roughness),
                     "index", json_number(l->index), "absorption", json_number_list(l->absorption, 3, 1.0));
}

static json_t *hair_json(const struct hair_fit *h)
{
    const struct hair_blend *b = &h->blend;
    return json_pack("{s:[o, o], s:o, s:o}", "hair", lobes_json(&b->lobes[0], 1.0 - b->second_share),
                     lobes_json(&b->lobes[1], b->second_share), "fitted_albedo", json_number_list(h->albedo, 3, 1.0),
                     "fitted_turned_back", json_number_list(h->turned, 3, 1.0));
}

json_t *export_hair_json(const struct export_scene *e)
{
    json_t *materials = json_array();
    for (size_t g = 0; g < e->model->setup->sets.n_set; g++)
        json_array_append_new(materials, export_material_json(e, g, hair_json(&e->hair[g])));
    return materials;
}
