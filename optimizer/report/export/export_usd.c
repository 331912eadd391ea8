/* results/export/usd/: the fitted cloth as Universal Scene Description, cloth.usda: the fibers of each group as
 * BasisCurves (cubic B-splines) with widths and a display colour, a PointInstancer that repeats their tile, the black
 * sheet as a Mesh, camera and lamp of the first row. Millimetres, z is up.
 *
 * Each material has two surfaces: for renderers that read MaterialX in USD (outputs:mtlx:surface) the mixture of two
 * hair materials of hair_on_cloth.h, and for all others a UsdPreviewSurface. That one lets no light through a fiber; it
 * is the opaque fiber of hair_fit.h. */
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/report/export/export_scene.h"

#include <math.h>
#include <stddef.h>

static const double mm = 1e3;

static void print_counts(FILE *text, const struct export_scene *e, size_t group)
{
    const char *comma = "";
    fprintf(text, "                int[] curveVertexCounts = [");
    for (size_t i = 0; i < e->report->in.made->fiber.n_fiber; i++)
        if (export_fiber_in(e, i, group)) {
            fprintf(text, "%s%zu", comma, export_n_point(e, i));
            comma = ", ";
        }
    fprintf(text, "]\n");
}

static void print_widths(FILE *text, const struct export_scene *e, size_t group)
{
    const bool varies = e->report->in.made->fiber.shape != NULL;
    const char *comma = "";
    fprintf(text, "                float[] widths = [");
    for (size_t i = 0; i < e->report->in.made->fiber.n_fiber; i++)
        for (size_t k = 0; export_fiber_in(e, i, group) && k < (varies ? export_n_point(e, i) : 1); k++) {
            fprintf(text, "%s%.6f", comma, 2.0 * export_point_radius_mm(e, i, k));
            comma = ", ";
        }
    fprintf(text, "] (\n                    interpolation = \"%s\"\n                )\n",
            varies ? "vertex" : "uniform");
}

/* Also the box of the points, wider by the radius. */
static void print_points(FILE *text, const struct export_scene *e, size_t group)
{
    const char *comma = "";
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, p[3];
    fprintf(text, "                point3f[] points = [");
    for (size_t i = 0; i < e->report->in.made->fiber.n_fiber; i++) {
        if (!export_fiber_in(e, i, group)) continue;
        for (size_t k = 0; k < export_n_point(e, i); k++, comma = ", ") {
            export_point(e, i, k, p);
            fprintf(text, "%s(%.6f, %.6f, %.6f)", comma, p[0], p[1], p[2]);
            for (int a = 0; a < 3; a++) {
                low[a] = fmin(low[a], p[a] - export_point_radius_mm(e, i, k));
                high[a] = fmax(high[a], p[a] + export_point_radius_mm(e, i, k));
            }
        }
    }
    fprintf(text,
            "]\n                float3[] extent = "
            "[(%.6f, %.6f, %.6f), (%.6f, %.6f, %.6f)]\n",
            low[0], low[1], low[2], high[0], high[1], high[2]);
}

static void print_curves(FILE *text, const struct export_scene *e, size_t group)
{
    const double *c = e->hair[group].surface.diffuse;
    fprintf(text,
            "            def BasisCurves \"fibers_%zu\" (\n"
            "                prepend apiSchemas = [\"MaterialBindingAPI\"]\n            )\n            {\n"
            "                uniform token type = \"cubic\"\n                uniform token basis = \"bspline\"\n"
            "                uniform token wrap = \"nonperiodic\"\n",
            group);
    print_counts(text, e, group);
    print_points(text, e, group);
    print_widths(text, e, group);
    fprintf(text,
            "                color3f[] primvars:displayColor = [(%.6g, %.6g, %.6g)]\n"
            "                rel material:binding = </Cloth/Materials/fiber_%zu>\n            }\n",
            c[0], c[1], c[2], group);
}

static void print_tiles(FILE *text, const struct export_scene *e)
{
    int n[2];
    double at[2];
    export_repeats(e, n);
    fprintf(text, "    def PointInstancer \"Tiles\"\n    {\n        rel prototypes = </Cloth/Tiles/Tile>\n"
                  "        int[] protoIndices = [");
    for (int i = 0; i < n[0] * n[1]; i++) fprintf(text, "%s0", i == 0 ? "" : ", ");
    fprintf(text, "]\n        point3f[] positions = [");
    for (int i = 0; i < n[0] * n[1]; i++) {
        export_repeat_at(e, n, i / n[1], i % n[1], at);
        fprintf(text, "%s(%.9g, %.9g, 0)", i == 0 ? "" : ", ", at[0], at[1]);
    }
    fprintf(text, "]\n        def Xform \"Tile\"\n        {\n");
    for (size_t g = 0; g < e->model->setup->sets.n_set; g++) print_curves(text, e, g);
    fprintf(text, "        }\n    }\n");
}

/* One hair material. MaterialX takes a cuticle angle of 0.5 for scales that are not tilted, and takes the variances of
 * light that goes through and of light that is reflected inside as 0.5^2 and 2^2 times the variance of the surface
 * reflection, as pbrt does. */
static void print_hair(FILE *text, const char *name, size_t i, const struct hair_lobes *h)
{
    const double *a = h->absorption;
    fprintf(text,
            "            def Shader \"roughness_%zu\"\n            {\n"
            "                uniform token info:id = \"ND_chiang_hair_roughness\"\n"
            "                float inputs:longitudinal = %.9g\n                float inputs:azimuthal = %.9g\n"
            "                float inputs:scale_TT = 0.5\n                float inputs:scale_TRT = 2\n"
            "                float2 outputs:roughness_R\n                float2 outputs:roughness_TT\n"
            "                float2 outputs:roughness_TRT\n            }\n"
            "            def Shader \"hair_%zu\"\n            {\n"
            "                uniform token info:id = \"ND_chiang_hair_bsdf\"\n"
            "                float inputs:ior = %.9g\n                float inputs:cuticle_angle = 0.5\n"
            "                float3 inputs:absorption_coefficient = (%.9g, %.9g, %.9g)\n",
            i, h->longitudinal_roughness, h->azimuthal_roughness, i, h->index, a[0], a[1], a[2]);
    static const char *const lobe[] = {"R", "TT", "TRT"};
    for (size_t k = 0; k < sizeof lobe / sizeof lobe[0]; k++)
        fprintf(text,
                "                float2 inputs:roughness_%s.connect = "
                "</Cloth/Materials/%s/roughness_%zu.outputs:roughness_%s>\n",
                lobe[k], name, i, lobe[k]);
    fprintf(text, "                token outputs:out\n            }\n");
}

static void print_blend(FILE *text, const char *name, const struct hair_blend *b)
{
    for (size_t i = 0; i < HAIR_FIT_N_BLEND; i++) print_hair(text, name, i, &b->lobes[i]);
    fprintf(text,
            "            def Shader \"mixture\"\n            {\n"
            "                uniform token info:id = \"ND_mix_bsdf\"\n"
            "                token inputs:bg.connect = </Cloth/Materials/%s/hair_0.outputs:out>\n"
            "                token inputs:fg.connect = </Cloth/Materials/%s/hair_1.outputs:out>\n"
            "                float inputs:mix = %.9g\n                token outputs:out\n            }\n"
            "            def Shader \"hair\"\n            {\n"
            "                uniform token info:id = \"ND_surface\"\n"
            "                token inputs:bsdf.connect = </Cloth/Materials/%s/mixture.outputs:out>\n"
            "                token outputs:out\n            }\n",
            name, name, b->second_share, name);
}

/* blend: NULL for a surface that is no fiber. */
static void print_material(FILE *text, const char *name, const struct surface_fit *f, const struct hair_blend *blend)
{
    fprintf(text, "        def Material \"%s\"\n        {\n", name);
    if (blend != NULL)
        fprintf(text, "            token outputs:mtlx:surface.connect = </Cloth/Materials/%s/hair.outputs:out>\n",
                name);
    fprintf(text,
            "            token outputs:surface.connect = </Cloth/Materials/%s/surface.outputs:surface>\n"
            "            def Shader \"surface\"\n            {\n"
            "                uniform token info:id = \"UsdPreviewSurface\"\n"
            "                color3f inputs:diffuseColor = (%.6g, %.6g, %.6g)\n"
            "                float inputs:ior = %.6g\n                float inputs:roughness = %.6g\n"
            "                token outputs:surface\n            }\n",
            name, f->diffuse[0], f->diffuse[1], f->diffuse[2], f->index, f->roughness);
    if (blend != NULL) print_blend(text, name, blend);
    fprintf(text, "        }\n");
}

static void print_materials(FILE *text, const struct export_scene *e)
{
    char name[32];
    fprintf(text, "    def Scope \"Materials\"\n    {\n");
    for (size_t g = 0; g < e->model->setup->sets.n_set; g++) {
        snprintf(name, sizeof name, "fiber_%zu", g);
        print_material(text, name, &e->hair[g].surface, &e->hair[g].blend);
    }
    print_material(text, "sheet", &(struct surface_fit){.index = 1.0, .roughness = 1.0}, NULL);
    fprintf(text, "    }\n");
}

static void print_sheet(FILE *text, const struct export_scene *e)
{
    double h[2], z;
    if (!export_sheet(e, h, &z)) return;
    fprintf(text,
            "    def Mesh \"Sheet\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )\n    {\n"
            "        int[] faceVertexCounts = [4]\n        int[] faceVertexIndices = [0, 1, 2, 3]\n"
            "        point3f[] points = "
            "[(%.9g, %.9g, %.9g), (%.9g, %.9g, %.9g), (%.9g, %.9g, %.9g), (%.9g, %.9g, %.9g)]\n"
            "        float3[] extent = [(%.9g, %.9g, %.9g), (%.9g, %.9g, %.9g)]\n"
            "        uniform token subdivisionScheme = \"none\"\n        uniform bool doubleSided = 1\n"
            "        color3f[] primvars:displayColor = [(0, 0, 0)]\n"
            "        rel material:binding = </Cloth/Materials/sheet>\n    }\n",
            -h[0], -h[1], z, h[0], -h[1], z, h[0], h[1], z, -h[0], h[1], z, -h[0], -h[1], z, h[0], h[1], z);
}

/* Rows of the matrix: the object's axes and its place. Cameras and lights look along -z. */
static void print_place(FILE *text, const double at[3], const double up[3])
{
    double x[3], y[3], z[3] = {at[0], at[1], at[2]};
    export_make_unit(z);
    export_cross(up, z, x);
    export_make_unit(x);
    export_cross(z, x, y);
    fprintf(text, "        matrix4d xformOp:transform = (");
    fprintf(text, " (%.9g, %.9g, %.9g, 0), (%.9g, %.9g, %.9g, 0),", x[0], x[1], x[2], y[0], y[1], y[2]);
    fprintf(text, " (%.9g, %.9g, %.9g, 0), (%.9g, %.9g, %.9g, 1) )\n", z[0], z[1], z[2], at[0], at[1], at[2]);
    fprintf(text, "        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n    }\n");
}

/* Apertures are tenths of a scene unit in USD. A focal length of 50 tenths. */
static void print_camera(FILE *text, const struct configuration *k, const struct export_view *v)
{
    const bool far = k->camera == CAMERA_FAR_FIELD;
    const double focal = 50.0, aperture = far ? 10.0 * v->width_mm : 2.0 * focal * tan(0.5 * v->fov_deg * M_PI / 180.0);
    fprintf(text,
            "    def Camera \"Camera\"\n    {\n        token projection = \"%s\"\n"
            "        float focalLength = %.9g\n        float horizontalAperture = %.9g\n"
            "        float verticalAperture = %.9g\n        float2 clippingRange = (%.9g, %.9g)\n",
            far ? "orthographic" : "perspective", focal, aperture, aperture, v->near_mm, 10.0 * v->near_mm);
    print_place(text, v->camera_mm, v->up);
}

static void print_lights(FILE *text, const struct configuration *k, const struct export_view *v)
{
    static const double up[3] = {0, 0.1, 1};
    const double *sky = k->environment_rgb;
    if (k->light == LIGHT_DIRECTIONAL) {
        fprintf(text,
                "    def DistantLight \"Lamp\"\n    {\n        float inputs:angle = 0\n"
                "        bool inputs:normalize = 1\n        float inputs:intensity = %.9g\n",
                v->irradiance);
        print_place(text, v->lamp_mm, up);
    } else if (k->light == LIGHT_SQUARE_LAMP) {
        fprintf(text,
                "    def RectLight \"Lamp\"\n    {\n        float inputs:width = %.9g\n"
                "        float inputs:height = %.9g\n        float inputs:intensity = %.9g\n",
                mm * k->lamp_side_m, mm * k->lamp_side_m, v->radiance);
        print_place(text, v->lamp_mm, up);
    }
    if (sky[0] + sky[1] + sky[2] > 0.0)
        fprintf(text,
                "    def DomeLight \"Sky\"\n    {\n        float inputs:intensity = 1\n"
                "        color3f inputs:color = (%.9g, %.9g, %.9g)\n    }\n",
                sky[0], sky[1], sky[2]);
}

static status write_stage(const struct export_scene *e, struct error *err)
{
    const struct configuration *k = &e->report->in.job->rows->observation.item[0].configuration;
    const struct export_view v = export_view_of(e, k);
    struct export_text t;
    status s = export_text_open(&t, err);
    if (s != STATUS_OK) return s;
    fprintf(t.file, "#usda 1.0\n(\n    defaultPrim = \"Cloth\"\n    doc = \"Made by Selvedge.\"\n"
                    "    metersPerUnit = 0.001\n    upAxis = \"Z\"\n)\n\n"
                    "def Xform \"Cloth\" (\n    kind = \"component\"\n)\n{\n");
    print_tiles(t.file, e);
    print_sheet(t.file, e);
    print_materials(t.file, e);
    fprintf(t.file, "}\n\ndef Xform \"View\"\n{\n");
    print_camera(t.file, k, &v);
    print_lights(t.file, k, &v);
    fprintf(t.file, "}\n");
    return export_text_close(e, &t, "cloth.usda", err);
}

/* The hair materials, as the other formats have them, and beside them the preview surface. */
static json_t *preview_json(const struct hair_fit *h)
{
    const struct surface_fit *f = &h->surface;
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "diffuse_color", json_number_list(f->diffuse, 3, 1.0), "index",
                     json_number(f->index), "roughness", json_number(f->roughness), "rel_rms", json_number(f->rel_rms),
                     "albedo", json_number_list(f->albedo, 3, 1.0), "turned_back", json_number_list(f->turned, 3, 1.0));
}

static status write_usd(struct export_scene *e, json_t **materials, struct error *err)
{
    status s = export_rows_write(e, err);
    if (s == STATUS_OK) s = write_stage(e, err);
    if (s != STATUS_OK) return s;
    *materials = export_hair_json(e);
    for (size_t g = 0; g < e->model->setup->sets.n_set; g++)
        json_object_set_new(json_array_get(*materials, g), "preview_surface", preview_json(&e->hair[g]));
    return *materials != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot export as USD: out of memory");
}

EXPORT(usd, "The scene as Universal Scene Description: curves, with a preview surface that makes the cloth as bright.")

const struct export_format export_usd = {.has_hair = true, .write = write_usd};
