/* results/export/pbrt/: the fitted cloth for pbrt-v4 (pbrt.org/fileformat-v4). cloth.pbrt holds the tile of fibers,
 * repeated, with two of pbrt's "hair" materials mixed (hair_on_cloth.h) and the black sheet; fibers-<group>.pbrt the
 * curves of one group; view-<row>.pbrt lamp, camera and film of one row, and includes the cloth.
 *
 * pbrt scales a light given as RGB so that its value is the value of the picture with the film's standard sensor. A
 * lamp with alpha 0 lights the cloth but is not seen. Pictures of pbrt are left-handed, therefore the Scale. */
#include "optimizer/job/document/job_results.h"
#include "optimizer/report/export/export_scene.h"

#include <stddef.h>

enum { MAX_VIEW = 200, N_POINT_A_LINE = 4 };
static const double mm = 1e3;

static void print_fiber(FILE *text, const struct export_scene *e, size_t i)
{
    double p[3], width = 2.0 * export_radius_mm(e, i);
    fprintf(text,
            "Shape \"curve\" \"string type\" \"cylinder\" \"string basis\" \"bspline\" \"float width\" %.6f\n"
            "  \"point3 P\" [",
            width);
    for (size_t k = 0; k < export_n_point(e, i); k++) {
        export_point(e, i, k, p);
        fprintf(text, "%s%.6f %.6f %.6f", k == 0 ? " " : k % N_POINT_A_LINE == 0 ? "\n    " : "  ", p[0], p[1], p[2]);
    }
    fprintf(text, " ]\n");
}

/* Materials "fiber-<group>-0" and "-1", and "fiber-<group>", which mixes them. */
static void print_material(FILE *text, size_t group, const struct hair_blend *b)
{
    for (int k = 0; k < HAIR_FIT_N_BLEND; k++) {
        const struct hair_lobes *l = &b->lobes[k];
        fprintf(text,
                "MakeNamedMaterial \"fiber-%zu-%d\" \"string type\" \"hair\" \"rgb sigma_a\" [ %.6g %.6g %.6g ] "
                "\"float eta\" %.6g\n  \"float beta_m\" %.6g \"float beta_n\" %.6g \"float alpha\" 0\n",
                group, k, l->absorption[0], l->absorption[1], l->absorption[2], l->index, l->longitudinal_roughness,
                l->azimuthal_roughness);
    }
    fprintf(text,
            "MakeNamedMaterial \"fiber-%zu\" \"string type\" \"mix\" \"string materials\" [ \"fiber-%zu-0\" "
            "\"fiber-%zu-1\" ] \"float amount\" %.6g\n",
            group, group, group, b->second_share);
}

static void print_tile(FILE *text, const struct export_scene *e)
{
    char name[32];
    for (size_t g = 0; g < e->model->setup->sets.n_set; g++) print_material(text, g, &e->hair[g].blend);
    fprintf(text, "ObjectBegin \"tile\"\n");
    for (size_t g = 0; g < e->model->setup->sets.n_set; g++) {
        export_fibers_name(g, ".pbrt", name);
        fprintf(text, "  NamedMaterial \"fiber-%zu\"\n  Include \"%s\"\n", g, name);
    }
    fprintf(text, "ObjectEnd\n");
}

static void print_sheet(FILE *text, const struct export_scene *e)
{
    double half[2], z;
    if (!export_sheet(e, half, &z)) return;
    fprintf(
        text,
        "AttributeBegin\n  Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n  Shape \"bilinearmesh\" \"point3 P\" "
        "[ %.9g %.9g %.9g  %.9g %.9g %.9g  %.9g %.9g %.9g  %.9g %.9g %.9g ]\nAttributeEnd\n",
        -half[0], -half[1], z, half[0], -half[1], z, -half[0], half[1], z, half[0], half[1], z);
}

static status write_cloth(const struct export_scene *e, struct error *err)
{
    struct export_text t;
    int n[2];
    double at[2];
    status s = export_text_open(&t, err);
    if (s != STATUS_OK) return s;
    fprintf(t.file, "# Made by Selvedge, for pbrt-v4. Lengths are millimetres; z = 0 is the top of the cloth.\n");
    print_tile(t.file, e);
    export_repeats(e, n);
    for (int i = 0; i < n[0]; i++)
        for (int j = 0; j < n[1]; j++) {
            export_repeat_at(e, n, i, j, at);
            fprintf(t.file, "AttributeBegin Translate %.9g %.9g 0 ObjectInstance \"tile\" AttributeEnd\n", at[0],
                    at[1]);
        }
    print_sheet(t.file, e);
    return export_text_close(e, &t, "cloth.pbrt", err);
}

static void print_lamp(FILE *text, const struct configuration *k, const struct export_view *v)
{
    double corner[4][3];
    if (k->light == LIGHT_DIRECTIONAL) {
        fprintf(text, "LightSource \"distant\" \"point3 from\" [ %.9g %.9g %.9g ] \"point3 to\" [ 0 0 0 ] ",
                v->lamp_mm[0], v->lamp_mm[1], v->lamp_mm[2]);
        fprintf(text, "\"rgb L\" [ %.9g %.9g %.9g ]\n", v->irradiance, v->irradiance, v->irradiance);
        return;
    }
    export_lamp_corners(v, mm * k->lamp_side_m, corner);
    fprintf(text, "AttributeBegin\n  AreaLightSource \"diffuse\" \"rgb L\" [ %.9g %.9g %.9g ]\n", v->radiance,
            v->radiance, v->radiance);
    fprintf(text, "  Shape \"bilinearmesh\" \"float alpha\" 0 \"point3 P\" [");
    for (int i = 0; i < 4; i++) fprintf(text, " %.9g %.9g %.9g ", corner[i][0], corner[i][1], corner[i][2]);
    fprintf(text, "]\nAttributeEnd\n");
}

static void print_camera(FILE *text, const struct configuration *k, const struct export_view *v)
{
    const double half = 0.5 * v->width_mm;
    fprintf(text, "Scale -1 1 1\nLookAt %.9g %.9g %.9g  0 0 0  %.9g %.9g %.9g\n", v->camera_mm[0], v->camera_mm[1],
            v->camera_mm[2], v->up[0], v->up[1], v->up[2]);
    if (k->camera == CAMERA_FAR_FIELD)
        fprintf(text, "Camera \"orthographic\" \"float screenwindow\" [ %.9g %.9g %.9g %.9g ]\n", -half, half, -half,
                half);
    else
        fprintf(text, "Camera \"perspective\" \"float fov\" %.9g\n", v->fov_deg);
}

static status write_view(const struct export_scene *e, size_t i, struct error *err)
{
    const struct configuration *k = &e->report->in.job->rows->observation.item[i].configuration;
    const struct export_view v = export_view_of(e, k);
    const double *sky = k->environment_rgb;
    struct export_text t;
    char name[32];
    status s = export_text_open(&t, err);
    if (s != STATUS_OK) return s;
    fprintf(t.file, "# Row %zu of rows.csv: pbrt view-%zu.pbrt\n", i, i);
    print_camera(t.file, k, &v);
    fprintf(
        t.file,
        "Film \"rgb\" \"integer xresolution\" 256 \"integer yresolution\" 256 \"string filename\" \"view-%zu.exr\"\n"
        "PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\n"
        "Sampler \"independent\" \"integer pixelsamples\" 64\nIntegrator \"path\" \"integer maxdepth\" 1000\n"
        "WorldBegin\n",
        i);
    if (k->light != LIGHT_NO_LAMP) print_lamp(t.file, k, &v);
    if (sky[0] + sky[1] + sky[2] > 0.0)
        fprintf(t.file, "LightSource \"infinite\" \"rgb L\" [ %.9g %.9g %.9g ]\n", sky[0], sky[1], sky[2]);
    fprintf(t.file, "Include \"cloth.pbrt\"\n");
    snprintf(name, sizeof name, "view-%zu.pbrt", i);
    return export_text_close(e, &t, name, err);
}

static status write_pbrt(struct export_scene *e, json_t **materials, struct error *err)
{
    status s = STATUS_OK;
    for (size_t g = 0; g < e->model->setup->sets.n_set && s == STATUS_OK; g++)
        s = export_fibers_write(e, g, ".pbrt", print_fiber, err);
    for (size_t i = 0; i < e->report->in.job->rows->observation.n && i < MAX_VIEW && s == STATUS_OK; i++)
        s = write_view(e, i, err);
    if (s == STATUS_OK) s = export_rows_write(e, err);
    if (s == STATUS_OK) s = write_cloth(e, err);
    if (s == STATUS_OK) *materials = export_hair_json(e);
    return s;
}

EXPORT(pbrt, "The scene for pbrt-v4, with one file for each row.")

const struct export_format export_pbrt = {.has_hair = true, .write = write_pbrt};
