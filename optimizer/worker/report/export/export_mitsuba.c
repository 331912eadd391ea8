#include "optimizer/worker/report/export/export_mitsuba.h"

#include "base/files/durable.h"
#include "geometry/volume/format/vol_file.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/report/export/hair_fit.h"
#include "optimizer/worker/report/json_number.h"
#include "optimizer/worker/report/result_json.h"
#include "optimizer/worker/stages/result/pipeline_choice.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char folder_name[] = "export/mitsuba";
static const double mm = 1e3, percent = 100.0;
/* The cloth is as wide as the widest view, and light goes sideways in it by no more than so many thicknesses. */
static const double reach_thickness = 8.0;
enum { MAX_REPEAT = 200 }; /* of the tile, to each side together */

struct mitsuba_export {
    struct pipeline_context *c;
    const struct pipeline_model *model;
    struct hair_fit hair[SCATTERING_MAX_SET];
    double z_low_m, z_high_m;
};

/* ---- files ---- */

static void path_of(const struct mitsuba_export *e, const char *name, char path[WORKER_PATH_BYTES])
{
    char relative[128];
    snprintf(relative, sizeof relative, "%s/%s", folder_name, name);
    worker_folder_path(e->c->folder, JOB_FOLDER_RESULTS, relative, path);
}

/* Closes the text, writes it under results/export/mitsuba/ and frees it. */
static status put_text(const struct mitsuba_export *e, const char *name, FILE *text, char **data, const size_t *n,
                       struct error *err)
{
    char path[WORKER_PATH_BYTES];
    bool whole = ferror(text) == 0;
    whole = fclose(text) == 0 && whole;
    path_of(e, name, path);
    status s = whole ? worker_folder_replace(e->c->folder, path, *data, *n, err)
                     : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", name);
    free(*data);
    *data = NULL;
    return s;
}

static void print_point(FILE *text, const double p[3], double radius_mm)
{
    fprintf(text, "%.6f %.6f %.6f %.6f\n", p[0], p[1], p[2], radius_mm);
}

/* Control points of a cubic B-spline: the vertices, and before the first and after the last one its neighbour mirrored
 * there, so that the curve begins and ends at them. Between, it passes a vertex by a sixth of the second difference. */
static void print_fiber(FILE *text, const struct mitsuba_export *e, size_t i)
{
    const struct fiber_set *f = &e->c->fiber;
    const size_t first = f->first_vertex[i], last = f->first_vertex[i + 1] - 1;
    const double radius_mm = mm * (double)f->radius_m[i];
    for (size_t k = first; k <= last + 2; k++) {
        size_t v = k == first ? first : k == last + 2 ? last : k - 1;
        size_t mirrored = k == first ? first + 1 : k == last + 2 ? last - 1 : v;
        double p[3];
        for (size_t a = 0; a < 3; a++) {
            double at = (double)f->position_m[3 * v + a], other = (double)f->position_m[3 * mirrored + a];
            p[a] = mm * ((mirrored == v ? at : 2.0 * at - other) - (a == 2 ? e->z_high_m : 0.0));
        }
        print_point(text, p, radius_mm);
    }
    fputc('\n', text);
}

static status write_fibers(const struct mitsuba_export *e, size_t group, struct error *err)
{
    const struct fiber_set *f = &e->c->fiber;
    char *data = NULL, name[32];
    size_t n = 0;
    FILE *text = open_memstream(&data, &n);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot export fibers: out of memory");
    for (size_t i = 0; i < f->n_fiber; i++)
        if (f->group[i] == group || e->model->sets.n_set == 1) print_fiber(text, e, i);
    snprintf(name, sizeof name, "fibers-%zu.txt", group);
    return put_text(e, name, text, &data, &n, err);
}

static status write_volumes(const struct mitsuba_export *e, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    if (!e->c->doc->has_volume) return STATUS_OK;
    status s = pipeline_need_volume(e->c, err);
    path_of(e, "density.vol", path);
    if (s == STATUS_OK) s = worker_folder_check(e->c->folder, err);
    if (s == STATUS_OK) s = vol_write_density(path, &e->c->volume, VOL_FLOAT32, err);
    path_of(e, "direction.vol", path);
    return s == STATUS_OK ? vol_write_direction(path, &e->c->direction, VOL_FLOAT32, err) : s;
}

/* ---- lamp, camera and rows ---- */

static void polar(double theta, double phi, double distance, double out[3])
{
    out[0] = distance * sin(theta) * cos(phi);
    out[1] = distance * sin(theta) * sin(phi);
    out[2] = distance * cos(theta);
}

struct view {
    double lamp_mm[3], camera_mm[3], up[3];
};

/* Lamp and camera are turned instead of the cloth. */
static struct view view_of(const struct configuration *k)
{
    struct view v;
    double phi = k->camera_phi_rad - k->cloth_rotation_rad, distance = k->camera_distance_m;
    if (k->camera == CAMERA_FAR_FIELD) distance = 1.0;
    polar(k->light_theta_rad, k->light_phi_rad - k->cloth_rotation_rad, mm * k->light_distance_m, v.lamp_mm);
    polar(k->camera_theta_rad, phi, mm * distance, v.camera_mm);
    polar(M_PI_2 - k->camera_theta_rad, phi + M_PI, 1.0, v.up);
    return v;
}

static void print_three(FILE *text, const double v[3], const char *end)
{
    fprintf(text, "%.9g,%.9g,%.9g%s", v[0], v[1], v[2], end);
}

static status write_rows(const struct mitsuba_export *e, struct error *err)
{
    const struct observation_set *o = &e->c->observation;
    char *data = NULL;
    size_t n = 0;
    FILE *text = open_memstream(&data, &n);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot export rows: out of memory");
    fprintf(text, "row,set,rotations,lamp_x_mm,lamp_y_mm,lamp_z_mm,camera_x_mm,camera_y_mm,camera_z_mm,up_x,up_y,up_z,"
                  "measured_r,measured_g,measured_b,rendered_r,rendered_g,rendered_b\n");
    for (size_t i = 0; i < o->n; i++) {
        const struct observation *row = &o->item[i];
        const struct view v = view_of(&row->configuration);
        double rendered[3], se[3];
        result_rendered_mean(e->model, i, rendered, se);
        fprintf(text, "%zu,%s,%u,", i, row->set == JOB_SET_FIT ? "fit" : "held-out",
                row->configuration.n_rotation > 1 ? row->configuration.n_rotation : 1);
        print_three(text, v.lamp_mm, ",");
        print_three(text, v.camera_mm, ",");
        print_three(text, v.up, ",");
        print_three(text, row->mean_rgb, ",");
        print_three(text, rendered, "\n");
    }
    return put_text(e, "rows.csv", text, &data, &n, err);
}

/* ---- scene.xml ---- */

static void print_material(FILE *text, const struct hair_lobes *l)
{
    fprintf(text,
            "    <bsdf type=\"hair\">\n"
            "      <float name=\"longitudinal_roughness\" value=\"%.6g\"/>\n"
            "      <float name=\"azimuthal_roughness\" value=\"%.6g\"/>\n"
            "      <float name=\"scale_tilt\" value=\"0\"/>\n"
            "      <float name=\"int_ior\" value=\"%.6g\"/>\n"
            "      <rgb name=\"sigma_a\" value=\"%.6g %.6g %.6g\"/>\n"
            "    </bsdf>\n",
            l->longitudinal_roughness, l->azimuthal_roughness, l->index, l->absorption[0], l->absorption[1],
            l->absorption[2]);
}

static void print_tile(FILE *text, const struct mitsuba_export *e)
{
    fprintf(text, "  <shape type=\"shapegroup\" id=\"tile\">\n");
    for (size_t g = 0; g < e->model->sets.n_set; g++) {
        fprintf(text, "   <shape type=\"bsplinecurve\">\n    <string name=\"filename\" value=\"fibers-%zu.txt\"/>\n",
                g);
        print_material(text, &e->hair[g].lobes);
        fprintf(text, "   </shape>\n");
    }
    fprintf(text, "  </shape>\n");
}

/* Half of the width of cloth that all rows together need. */
static double half_width_mm(const struct mitsuba_export *e)
{
    double most = 0.0, crop = 0.0;
    for (size_t i = 0; i < e->c->observation.n; i++) {
        const struct configuration *k = &e->c->observation.item[i].configuration;
        most = fmax(most, k->camera_theta_rad);
        crop = fmax(crop, k->crop_m);
    }
    return mm * (0.5 * crop / cos(most) * 1.1 + reach_thickness * (e->z_high_m - e->z_low_m));
}

/* Repeats of the tile along x and y. False: they do not cover what all rows together see. */
static bool count_repeats(const struct mitsuba_export *e, int n[2])
{
    bool enough = true;
    for (int a = 0; a < 2; a++) {
        double wanted = ceil(2.0 * half_width_mm(e) / (mm * e->c->fiber.tile_size_m[a])) + 1.0;
        enough = enough && wanted <= MAX_REPEAT;
        n[a] = (int)fmin(wanted, MAX_REPEAT);
    }
    return enough;
}

static void print_repeats(FILE *text, const struct mitsuba_export *e)
{
    const double *tile = e->c->fiber.tile_size_m;
    int n[2];
    count_repeats(e, n);
    for (int i = 0; i < n[0]; i++)
        for (int j = 0; j < n[1]; j++)
            fprintf(text,
                    "  <shape type=\"instance\"><ref id=\"tile\"/><transform name=\"to_world\">"
                    "<translate x=\"%.9g\" y=\"%.9g\"/></transform></shape>\n",
                    mm * tile[0] * (i - 0.5 * n[0]), mm * tile[1] * (j - 0.5 * n[1]));
    if (!e->c->doc->black_sheet) return;
    fprintf(text,
            "  <shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"%.9g\" y=\"%.9g\"/>"
            "<translate z=\"%.9g\"/></transform>\n"
            "    <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0 0 0\"/></bsdf></shape>\n",
            mm * tile[0] * n[0], mm * tile[1] * n[1], mm * (e->z_low_m - e->z_high_m) - 1e-3);
}

/* The lamp has radiance 1 on a white diffuser that faces it (configuration.h). */
static void print_lights(FILE *text, const struct configuration *k)
{
    double x = 0.5 * k->lamp_side_m / k->light_distance_m, y = x / sqrt(1.0 + x * x);
    if (k->light == LIGHT_DIRECTIONAL)
        fprintf(text,
                "  <emitter type=\"directional\"><transform name=\"to_world\"><lookat "
                "origin=\"$lamp_x,$lamp_y,$lamp_z\" target=\"0,0,0\" up=\"0,0.1,1\"/></transform>\n"
                "    <rgb name=\"irradiance\" value=\"%.9g\"/></emitter>\n",
                M_PI);
    else
        fprintf(text,
                "  <shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"%.9g\" y=\"%.9g\"/><lookat "
                "origin=\"$lamp_x,$lamp_y,$lamp_z\" target=\"0,0,0\" up=\"0,0.1,1\"/></transform>\n"
                "    <emitter type=\"area\"><rgb name=\"radiance\" value=\"%.9g\"/></emitter>\n"
                "    <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0\"/></bsdf></shape>\n",
                mm * 0.5 * k->lamp_side_m, mm * 0.5 * k->lamp_side_m, M_PI / (4.0 * y * atan(y)));
    if (k->environment_rgb[0] + k->environment_rgb[1] + k->environment_rgb[2] > 0.0)
        fprintf(text, "  <emitter type=\"constant\"><rgb name=\"radiance\" value=\"%.9g %.9g %.9g\"/></emitter>\n",
                k->environment_rgb[0], k->environment_rgb[1], k->environment_rgb[2]);
}

/* near_clip leaves out the lamp where it stands before the camera. */
static void print_camera(FILE *text, const struct mitsuba_export *e, const struct configuration *k)
{
    const double distance_mm = k->camera == CAMERA_FAR_FIELD ? mm : mm * k->camera_distance_m;
    const double near_mm = fmax(distance_mm - 2.0 * half_width_mm(e), 0.01 * distance_mm);
    const char *place = "<lookat origin=\"$camera_x,$camera_y,$camera_z\" target=\"0,0,0\" up=\"$up_x,$up_y,$up_z\"/>";
    if (k->camera == CAMERA_FAR_FIELD)
        fprintf(text,
                "  <sensor type=\"orthographic\"><transform name=\"to_world\"><scale x=\"%.9g\" "
                "y=\"%.9g\"/>%s</transform>\n",
                mm * 0.5 * k->crop_m, mm * 0.5 * k->crop_m, place);
    else
        fprintf(text,
                "  <sensor type=\"perspective\"><float name=\"fov\" value=\"%.9g\"/><transform "
                "name=\"to_world\">%s</transform>\n",
                2.0 * atan(0.5 * k->crop_m / k->camera_distance_m) * 180.0 / M_PI, place);
    fprintf(text, "    <float name=\"near_clip\" value=\"%.9g\"/>\n", near_mm);
    fprintf(text, "    <sampler type=\"independent\"><integer name=\"sample_count\" value=\"$spp\"/></sampler>\n"
                  "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"$px\"/><integer name=\"height\" "
                  "value=\"$px\"/><rfilter type=\"box\"/></film></sensor>\n");
}

static void print_defaults(FILE *text, const struct view *v)
{
    static const char axis[] = "xyz";
    const struct {
        const char *name;
        const double *at;
    } three[] = {{"lamp", v->lamp_mm}, {"camera", v->camera_mm}, {"up", v->up}};
    for (size_t i = 0; i < sizeof three / sizeof three[0]; i++)
        for (int a = 0; a < 3; a++)
            fprintf(text, "  <default name=\"%s_%c\" value=\"%.9g\"/>\n", three[i].name, axis[a], three[i].at[a]);
    fprintf(text, "  <default name=\"px\" value=\"256\"/>\n  <default name=\"spp\" value=\"64\"/>\n");
}

static status write_scene(const struct mitsuba_export *e, struct error *err)
{
    const struct configuration *k = &e->c->observation.item[0].configuration;
    const struct view v = view_of(k);
    char *data = NULL;
    size_t n = 0;
    FILE *text = open_memstream(&data, &n);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot export a scene: out of memory");
    fprintf(text, "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
                  "<!-- Made by Selvedge, for Mitsuba 3. Lengths are millimetres, radiances those of the job's rows.\n"
                  "     `mitsuba -D lamp_x=... -D camera_x=... scene.xml` shows another row of rows.csv. -->\n"
                  "<scene version=\"3.0.0\">\n");
    print_defaults(text, &v);
    fprintf(text, "  <integrator type=\"path\"><integer name=\"max_depth\" value=\"-1\"/></integrator>\n");
    print_camera(text, e, k);
    print_lights(text, k);
    print_tile(text, e);
    print_repeats(text, e);
    fprintf(text, "</scene>\n");
    return put_text(e, "scene.xml", text, &data, &n, err);
}

/* ---- what the result says ---- */

static json_t *material_json(const struct hair_fit *h)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "longitudinal_roughness",
                     json_number(h->lobes.longitudinal_roughness), "azimuthal_roughness",
                     json_number(h->lobes.azimuthal_roughness), "index", json_number(h->lobes.index), "absorption",
                     json_number_list(h->lobes.absorption, 3, 1.0), "rel_rms", json_number(h->rel_rms), "fitted_albedo",
                     json_number_list(h->albedo, 3, 1.0), "albedo", json_number_list(h->lobes_albedo, 3, 1.0),
                     "fitted_turned_back", json_number_list(h->turned, 3, 1.0), "turned_back",
                     json_number_list(h->lobes_turned, 3, 1.0));
}

static json_t *export_json(const struct mitsuba_export *e)
{
    json_t *materials = json_array();
    for (size_t g = 0; g < e->model->sets.n_set; g++) {
        json_t *m = material_json(&e->hair[g]);
        json_object_set_new(m, "group", e->model->sets.n_set > 1 ? json_string(e->c->doc->group[g]) : json_null());
        json_array_append_new(materials, m);
    }
    return json_pack("{s:s, s:s, s:o}", "format", "mitsuba", "folder", folder_name, "materials", materials);
}

/* ---- the whole ---- */

static status fit_materials(struct mitsuba_export *e, struct error *err)
{
    const struct appearance *a = &e->model->appearance;
    if (a->kind != MODEL_SURFACE)
        return error_set(err, STATUS_UNSUPPORTED, "the model '%s' sees no fibers, which an export to Mitsuba needs",
                         a->id);
    status s = STATUS_OK;
    for (size_t g = 0; g < e->model->sets.n_set && s == STATUS_OK; g++) {
        s = hair_fit_run(a->surface, e->model->fit.param + g * e->model->sets.n_own, &e->hair[g], err);
        if (s != STATUS_OK) break;
        log_info(e->c->log, "export to Mitsuba: hair lobes differ from the fitted scattering by %.0f %%",
                 percent * e->hair[g].rel_rms);
    }
    return s;
}

static void warn_of_rest(const struct mitsuba_export *e)
{
    int n[2];
    if (!count_repeats(e, n))
        worker_status_warn(e->c->status,
                           "the scene for Mitsuba has %d x %d repeats of the tile, the most that are written: the "
                           "widest view sees beyond them",
                           n[0], n[1]);
    if (e->c->environment != NULL)
        worker_status_warn(e->c->status, "the scene for Mitsuba has no image of the surroundings: add '%s' to it",
                           e->c->doc->environment_file);
}

status export_mitsuba_write(struct pipeline_context *c, json_t **json, struct error *err)
{
    struct mitsuba_export e = {.c = c, .model = &c->model[pipeline_best_model(c)]};
    char path[WORKER_PATH_BYTES];
    fiber_set_z_range_m(&c->fiber, &e.z_low_m, &e.z_high_m);
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, folder_name, path);
    status s = fit_materials(&e, err);
    if (s == STATUS_OK) s = durable_make_folder(path, err);
    for (size_t g = 0; g < e.model->sets.n_set && s == STATUS_OK; g++) s = write_fibers(&e, g, err);
    if (s == STATUS_OK) s = write_volumes(&e, err);
    if (s == STATUS_OK) s = write_rows(&e, err);
    if (s == STATUS_OK) s = write_scene(&e, err);
    if (s != STATUS_OK) return s;
    warn_of_rest(&e);
    *json = export_json(&e);
    return STATUS_OK;
}
