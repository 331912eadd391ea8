/* results/export/mitsuba/: the fitted cloth for Mitsuba 3. scene.xml holds the tile of fibers, repeated, with the hair
 * lobes that come nearest to the fitted cloth (hair_on_cloth.h), lamp, camera and black sheet of the first row;
 * fibers-<group>.txt the fibers of one group. Of models that selvedge_fiber.py knows, exact.xml is the same scene with
 * the scattering as it was fitted, by the plug-ins of that file. Of a scanned cloth also density.vol, direction.vol and
 * sggx.vol with float32 samples, as Mitsuba's gridvolume reads them. */
#include "base/angle.h"
#include "geometry/volume/format/vol_file.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/report/export/export_scene.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

static const double mm = 1e3;
/* Least projected area of the flakes along the fiber, over that across it. */
static const double least_along = 0.02;

static const unsigned char plugin[] = {
#include "generated/selvedge_fiber.bytes"
};

bool export_mitsuba_is_exact(const struct export_scene *e)
{
    const char *id = e->model->setup->appearance.id;
    return strcmp(id, "two_lobe.v1") == 0 || strcmp(id, "textile.v3") == 0;
}

static void print_fiber(FILE *text, const struct export_scene *e, size_t i)
{
    double p[3];
    for (size_t k = 0; k < export_n_point(e, i); k++) {
        export_point(e, i, k, p);
        fprintf(text, "%.6f %.6f %.6f %.6f\n", p[0], p[1], p[2], export_point_radius_mm(e, i, k));
    }
    fputc('\n', text);
}

/* Projected area along the fiber over that across it, of flakes that are tilted so much that they widen a reflected ray
 * as the first group's hair materials do: by twice their tilt, whose variance is v (hair_lobes.h, equation for v). */
static double area_along(const struct export_scene *e)
{
    const struct hair_blend *b = &e->hair[0].blend;
    double variance = 0.0;
    for (int k = 0; k < HAIR_FIT_N_BLEND; k++) {
        const double r = b->lobes[k].longitudinal_roughness, sd = 0.726 * r + 0.812 * r * r + 3.7 * pow(r, 20.0);
        variance += (k == 0 ? 1.0 - b->second_share : b->second_share) * sd * sd;
    }
    return fmin(fmax(tan(fmin(0.5 * sqrt(variance), 0.7)), least_along), 1.0);
}

static status write_volumes(const struct export_scene *e, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    if (!e->report->in.job->scan->given) return STATUS_OK;
    status s = report_need_volume(e->report, err);
    export_path(e, "density.vol", path);
    if (s == STATUS_OK) s = worker_folder_check(e->report->in.job->tools->folder, err);
    if (s == STATUS_OK) s = vol_write_density(path, &e->report->volume.volume, VOL_FLOAT32, err);
    export_path(e, "direction.vol", path);
    if (s == STATUS_OK) s = vol_write_direction(path, &e->report->in.made->direction, VOL_FLOAT32, err);
    export_path(e, "sggx.vol", path);
    return s == STATUS_OK ? vol_write_sggx(path, &e->report->in.made->direction, area_along(e), err) : s;
}

/* ---- scene.xml ---- */

static void print_hair(FILE *text, const struct hair_lobes *l)
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

static void print_material(FILE *text, const struct hair_blend *b)
{
    fprintf(text, "    <bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"%.6g\"/>\n", b->second_share);
    for (int k = 0; k < HAIR_FIT_N_BLEND; k++) print_hair(text, &b->lobes[k]);
    fprintf(text, "    </bsdf>\n");
}

/* The fitted parameters of a group in the units of the job, with "_" for "." in their names. */
static void print_fitted(FILE *text, const struct export_scene *e, size_t group)
{
    const struct appearance *a = &e->model->setup->appearance;
    const double *param = e->model->fit->result.param + group * a->n_param;
    fprintf(text, "    <bsdf type=\"selvedge_fiber\">\n      <string name=\"model\" value=\"%s\"/>\n", a->id);
    for (size_t p = 0; p < a->n_param; p++) {
        char name[64];
        snprintf(name, sizeof name, "%s", a->param[p].name);
        for (char *c = strchr(name, '.'); c != NULL; c = strchr(c, '.')) *c = '_';
        fprintf(text, "      <float name=\"%s\" value=\"%.9g\"/>\n", name,
                param[p] / (a->param[p].unit == PARAM_UNIT_DEG ? RAD_PER_DEG : 1.0));
    }
    fprintf(text, "    </bsdf>\n");
}

static void print_tile(FILE *text, const struct export_scene *e, bool exact)
{
    fprintf(text, "  <shape type=\"shapegroup\" id=\"tile\">\n");
    for (size_t g = 0; g < e->model->setup->sets.n_set; g++) {
        fprintf(text, "   <shape type=\"bsplinecurve\">\n    <string name=\"filename\" value=\"fibers-%zu.txt\"/>\n",
                g);
        if (exact)
            print_fitted(text, e, g);
        else
            print_material(text, &e->hair[g].blend);
        fprintf(text, "   </shape>\n");
    }
    fprintf(text, "  </shape>\n");
}

static void print_repeats(FILE *text, const struct export_scene *e)
{
    int n[2];
    double at[2], half[2], z;
    export_repeats(e, n);
    for (int i = 0; i < n[0]; i++)
        for (int j = 0; j < n[1]; j++) {
            export_repeat_at(e, n, i, j, at);
            fprintf(text,
                    "  <shape type=\"instance\"><ref id=\"tile\"/><transform name=\"to_world\">"
                    "<translate x=\"%.9g\" y=\"%.9g\"/></transform></shape>\n",
                    at[0], at[1]);
        }
    if (!export_sheet(e, half, &z)) return;
    fprintf(text,
            "  <shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"%.9g\" y=\"%.9g\"/>"
            "<translate z=\"%.9g\"/></transform>\n"
            "    <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0 0 0\"/></bsdf></shape>\n",
            half[0], half[1], z);
}

static void print_lights(FILE *text, const struct configuration *k, const struct export_view *v)
{
    if (k->light == LIGHT_DIRECTIONAL)
        fprintf(text,
                "  <emitter type=\"directional\"><transform name=\"to_world\"><lookat "
                "origin=\"$lamp_x,$lamp_y,$lamp_z\" target=\"0,0,0\" up=\"0,0.1,1\"/></transform>\n"
                "    <rgb name=\"irradiance\" value=\"%.9g\"/></emitter>\n",
                v->irradiance);
    else
        fprintf(text,
                "  <shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"%.9g\" y=\"%.9g\"/><lookat "
                "origin=\"$lamp_x,$lamp_y,$lamp_z\" target=\"0,0,0\" up=\"0,0.1,1\"/></transform>\n"
                "    <emitter type=\"area\"><rgb name=\"radiance\" value=\"%.9g\"/></emitter>\n"
                "    <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0\"/></bsdf></shape>\n",
                mm * 0.5 * k->lamp_side_m, mm * 0.5 * k->lamp_side_m, v->radiance);
    if (k->environment_rgb[0] + k->environment_rgb[1] + k->environment_rgb[2] > 0.0)
        fprintf(text, "  <emitter type=\"constant\"><rgb name=\"radiance\" value=\"%.9g %.9g %.9g\"/></emitter>\n",
                k->environment_rgb[0], k->environment_rgb[1], k->environment_rgb[2]);
}

static void print_camera(FILE *text, const struct configuration *k, const struct export_view *v)
{
    const char *place = "<lookat origin=\"$camera_x,$camera_y,$camera_z\" target=\"0,0,0\" up=\"$up_x,$up_y,$up_z\"/>";
    if (k->camera == CAMERA_FAR_FIELD)
        fprintf(text,
                "  <sensor type=\"orthographic\"><transform name=\"to_world\"><scale x=\"%.9g\" "
                "y=\"%.9g\"/>%s</transform>\n",
                0.5 * v->width_mm, 0.5 * v->width_mm, place);
    else
        fprintf(text,
                "  <sensor type=\"perspective\"><float name=\"fov\" value=\"%.9g\"/><transform "
                "name=\"to_world\">%s</transform>\n",
                v->fov_deg, place);
    fprintf(text, "    <float name=\"near_clip\" value=\"%.9g\"/>\n", v->near_mm);
    fprintf(text, "    <sampler type=\"independent\"><integer name=\"sample_count\" value=\"$spp\"/></sampler>\n"
                  "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"$px\"/><integer name=\"height\" "
                  "value=\"$px\"/><rfilter type=\"box\"/></film></sensor>\n");
}

static void print_defaults(FILE *text, const struct export_view *v)
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

static status write_scene(const struct export_scene *e, bool exact, struct error *err)
{
    const struct configuration *k = &e->report->in.job->rows->observation.item[0].configuration;
    const struct export_view v = export_view_of(e, k);
    struct export_text t;
    status s = export_text_open(&t, err);
    if (s != STATUS_OK) return s;
    fprintf(t.file,
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
            "<!-- Made by Selvedge, for Mitsuba 3. Lengths are millimetres, radiances those of the job's rows.\n"
            "     `mitsuba -D lamp_x=... -D camera_x=... scene.xml` shows another row of rows.csv.%s -->\n"
            "<scene version=\"3.0.0\">\n",
            exact ? "\n     Python that loads this file imports selvedge_fiber first, which has the plug-ins." : "");
    print_defaults(t.file, &v);
    if (exact)
        fprintf(t.file,
                "  <integrator type=\"selvedge_path\"><boolean name=\"whole_width\" value=\"%s\"/></integrator>\n",
                e->model->setup->appearance.surface->across_width ? "true" : "false");
    else
        fprintf(t.file, "  <integrator type=\"path\"><integer name=\"max_depth\" value=\"-1\"/></integrator>\n");
    print_camera(t.file, k, &v);
    print_lights(t.file, k, &v);
    print_tile(t.file, e, exact);
    print_repeats(t.file, e);
    fprintf(t.file, "</scene>\n");
    return export_text_close(e, &t, exact ? "exact.xml" : "scene.xml", err);
}

static status write_exact_scene(const struct export_scene *e, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    if (!export_mitsuba_is_exact(e)) return STATUS_OK;
    export_path(e, "selvedge_fiber.py", path);
    status s = worker_folder_replace(e->report->in.job->tools->folder, path, plugin, sizeof plugin, err);
    return s == STATUS_OK ? write_scene(e, true, err) : s;
}

static status write_mitsuba(struct export_scene *e, json_t **materials, struct error *err)
{
    status s = STATUS_OK;
    for (size_t g = 0; g < e->model->setup->sets.n_set && s == STATUS_OK; g++)
        s = export_fibers_write(e, g, ".txt", print_fiber, err);
    if (s == STATUS_OK) s = write_volumes(e, err);
    if (s == STATUS_OK) s = export_rows_write(e, err);
    if (s == STATUS_OK) s = write_scene(e, false, err);
    if (s == STATUS_OK) s = write_exact_scene(e, err);
    if (s == STATUS_OK) *materials = export_hair_json(e);
    return s;
}

EXPORT(mitsuba, "A scene for Mitsuba 3: fibers, lamp, camera, and hair lobes near to the fitted scattering.")

const struct export_format export_mitsuba = {.has_hair = true, .write = write_mitsuba};
