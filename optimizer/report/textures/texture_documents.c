#include "optimizer/report/textures/texture_documents.h"

#include "optimizer/job/document/fiber_composition.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/json_number.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

static const double mm_per_inch = 25.4;

/* ---- MaterialX ---- */

static void print_image(FILE *text, const char *name, const char *type, const char *file, bool color,
                        const double size_mm[2])
{
    fprintf(text,
            "    <tiledimage name=\"%s\" type=\"%s\">\n"
            "      <input name=\"file\" type=\"filename\" value=\"%s\"%s/>\n"
            "      <input name=\"realworldimagesize\" type=\"vector2\" value=\"%.9g, %.9g\" unittype=\"distance\" "
            "unit=\"millimeter\"/>\n"
            "      <input name=\"realworldtilesize\" type=\"vector2\" value=\"%.9g, %.9g\" unittype=\"distance\" "
            "unit=\"millimeter\"/>\n    </tiledimage>\n",
            name, type, file, color ? " colorspace=\"srgb_texture\"" : "", size_mm[0], size_mm[1], size_mm[0],
            size_mm[1]);
}

/* base = reflected + transmitted, and the share of the latter goes to the thin-walled subsurface, which scatters
 * forwards only: (1 - share) base is reflected and share base is transmitted, as the maps have it. Layers above let a
 * part of the light through, by which the map of transmitted light is divided before. */
static const char graph_nodes[] =
    "    <add name=\"scattered\" type=\"color3\">\n"
    "      <input name=\"in1\" type=\"color3\" nodename=\"albedo\"/>\n"
    "      <input name=\"in2\" type=\"color3\" nodename=\"through\"/>\n    </add>\n"
    "    <luminance name=\"gray_transmission\" type=\"color3\">\n"
    "      <input name=\"in\" type=\"color3\" nodename=\"through\"/>\n    </luminance>\n"
    "    <luminance name=\"gray_scattered\" type=\"color3\">\n"
    "      <input name=\"in\" type=\"color3\" nodename=\"scattered\"/>\n    </luminance>\n"
    "    <extract name=\"transmitted\" type=\"float\">\n"
    "      <input name=\"in\" type=\"color3\" nodename=\"gray_transmission\"/>\n"
    "      <input name=\"index\" type=\"integer\" value=\"0\"/>\n    </extract>\n"
    "    <extract name=\"all\" type=\"float\">\n"
    "      <input name=\"in\" type=\"color3\" nodename=\"gray_scattered\"/>\n"
    "      <input name=\"index\" type=\"integer\" value=\"0\"/>\n    </extract>\n"
    "    <max name=\"some\" type=\"float\">\n"
    "      <input name=\"in1\" type=\"float\" nodename=\"all\"/>\n"
    "      <input name=\"in2\" type=\"float\" value=\"0.001\"/>\n    </max>\n"
    "    <divide name=\"share\" type=\"float\">\n"
    "      <input name=\"in1\" type=\"float\" nodename=\"transmitted\"/>\n"
    "      <input name=\"in2\" type=\"float\" nodename=\"some\"/>\n    </divide>\n"
    "    <normalmap name=\"shading_normal\" type=\"vector3\">\n"
    "      <input name=\"in\" type=\"vector3\" nodename=\"normal\"/>\n    </normalmap>\n"
    "    <multiply name=\"degrees\" type=\"float\">\n"
    "      <input name=\"in1\" type=\"float\" nodename=\"direction\"/>\n"
    "      <input name=\"in2\" type=\"float\" value=\"360\"/>\n    </multiply>\n"
    "    <tangent name=\"along_u\" type=\"vector3\"/>\n"
    "    <normal name=\"surface_normal\" type=\"vector3\"/>\n"
    "    <rotate3d name=\"across_fibers\" type=\"vector3\">\n"
    "      <input name=\"in\" type=\"vector3\" nodename=\"along_u\"/>\n"
    "      <input name=\"amount\" type=\"float\" nodename=\"degrees\"/>\n"
    "      <input name=\"axis\" type=\"vector3\" nodename=\"surface_normal\"/>\n    </rotate3d>\n"
    "    <output name=\"out_base\" type=\"color3\" nodename=\"scattered\"/>\n"
    "    <output name=\"out_share\" type=\"float\" nodename=\"share\"/>\n"
    "    <output name=\"out_roughness\" type=\"float\" nodename=\"roughness\"/>\n"
    "    <output name=\"out_anisotropy\" type=\"float\" nodename=\"anisotropy\"/>\n"
    "    <output name=\"out_normal\" type=\"vector3\" nodename=\"shading_normal\"/>\n"
    "    <output name=\"out_tangent\" type=\"vector3\" nodename=\"across_fibers\"/>\n";

static const char surface_inputs[] =
    "    <input name=\"base_color\" type=\"color3\" nodegraph=\"maps\" output=\"out_base\"/>\n"
    "    <input name=\"subsurface_color\" type=\"color3\" nodegraph=\"maps\" output=\"out_base\"/>\n"
    "    <input name=\"subsurface_weight\" type=\"float\" nodegraph=\"maps\" output=\"out_share\"/>\n"
    "    <input name=\"subsurface_scatter_anisotropy\" type=\"float\" value=\"1\"/>\n"
    "    <input name=\"geometry_thin_walled\" type=\"boolean\" value=\"true\"/>\n"
    "    <input name=\"specular_roughness\" type=\"float\" nodegraph=\"maps\" output=\"out_roughness\"/>\n"
    "    <input name=\"specular_roughness_anisotropy\" type=\"float\" nodegraph=\"maps\" output=\"out_anisotropy\"/>\n"
    "    <input name=\"geometry_normal\" type=\"vector3\" nodegraph=\"maps\" output=\"out_normal\"/>\n"
    "    <input name=\"geometry_tangent\" type=\"vector3\" nodegraph=\"maps\" output=\"out_tangent\"/>\n";

/* Inputs without a map. */
static void print_numbers(FILE *text, const struct texture_surface *t)
{
    struct texture_input input[TEXTURE_N_INPUT];
    texture_surface_list(t, input);
    for (size_t i = 0; i < TEXTURE_N_INPUT; i++) {
        const double *v = input[i].value;
        fprintf(text, "    <input name=\"%s\" type=\"%s\" value=\"%.6g", input[i].name,
                input[i].n == 1 ? "float" : "color3", v[0]);
        if (input[i].n == 3) fprintf(text, ", %.6g, %.6g", v[1], v[2]);
        fprintf(text, "\"/>\n");
    }
}

status texture_materialx_write(const struct export_scene *e, const struct texture_surface *t, struct error *err)
{
    const struct texture_maps *m = t->maps;
    const double size_mm[2] = {m->pixel_mm[0] * (double)(m->repeat[0] * m->width),
                               m->pixel_mm[1] * (double)(m->repeat[1] * m->height)};
    struct export_text text;
    status s = export_text_open(&text, err);
    if (s != STATUS_OK) return s;
    fprintf(text.file, "<?xml version=\"1.0\"?>\n<materialx version=\"1.39\" colorspace=\"lin_rec709\">\n"
                       "  <nodegraph name=\"maps\">\n");
    print_image(text.file, "albedo", "color3", "base_color.png", true, size_mm);
    print_image(text.file, "transmission", "color3", "transmission.png", true, size_mm);
    print_image(text.file, "roughness", "float", "roughness.png", false, size_mm);
    print_image(text.file, "anisotropy", "float", "anisotropy.png", false, size_mm);
    print_image(text.file, "direction", "float", "anisotropy_rotation.png", false, size_mm);
    print_image(text.file, "normal", "vector3", "normal.png", false, size_mm);
    fprintf(text.file,
            "    <multiply name=\"through\" type=\"color3\">\n"
            "      <input name=\"in1\" type=\"color3\" nodename=\"transmission\"/>\n"
            "      <input name=\"in2\" type=\"float\" value=\"%.6g\"/>\n    </multiply>\n",
            1.0 / fmax(texture_surface_kept(t), 0.01));
    fputs(graph_nodes, text.file);
    if (m->cut_out) {
        print_image(text.file, "opacity", "float", "opacity.png", false, size_mm);
        fputs("    <output name=\"out_opacity\" type=\"float\" nodename=\"opacity\"/>\n", text.file);
    }
    fputs("  </nodegraph>\n", text.file);
    fprintf(text.file, "  <open_pbr_surface name=\"surface\" type=\"surfaceshader\">\n%s", surface_inputs);
    if (m->cut_out)
        fputs("    <input name=\"geometry_opacity\" type=\"float\" nodegraph=\"maps\" output=\"out_opacity\"/>\n",
              text.file);
    print_numbers(text.file, t);
    fputs("  </open_pbr_surface>\n  <surfacematerial name=\"cloth\" type=\"material\">\n"
          "    <input name=\"surfaceshader\" type=\"surfaceshader\" nodename=\"surface\"/>\n"
          "  </surfacematerial>\n</materialx>\n",
          text.file);
    return export_text_close(e, &text, "cloth.mtlx", err);
}

/* ---- U3M ---- */

enum { PREVIEW_PX = 512 };

double texture_height_range_mm(const struct export_scene *e) { return 1e3 * fmax(e->z_high_m - e->z_low_m, 1e-9); }

void texture_preview_size(const struct texture_maps *m, size_t size[2])
{
    const size_t whole[2] = {m->width * m->repeat[0], m->height * m->repeat[1]};
    for (int a = 0; a < 2; a++) size[a] = whole[a] < PREVIEW_PX ? whole[a] : PREVIEW_PX;
}

static json_t *preview_json(const struct texture_maps *m)
{
    size_t size[2];
    texture_preview_size(m, size);
    return json_pack("{s:f, s:f, s:{s:f, s:f}, s:s}", "width", m->pixel_mm[0] * (double)size[0], "height",
                     m->pixel_mm[1] * (double)size[1], "dpi", "x", mm_per_inch / m->pixel_mm[0], "y",
                     mm_per_inch / m->pixel_mm[1], "path", "preview.png");
}

static json_t *image_json(const struct texture_maps *m, const char *file)
{
    return json_pack("{s:f, s:f, s:{s:f, s:f}, s:s, s:{s:f, s:s}}", "width",
                     m->pixel_mm[0] * (double)(m->repeat[0] * m->width), "height",
                     m->pixel_mm[1] * (double)(m->repeat[1] * m->height), "dpi", "x", mm_per_inch / m->pixel_mm[0], "y",
                     mm_per_inch / m->pixel_mm[1], "path", file, "repeat", "rotation", 0.0, "mode", "normal");
}

static json_t *number_json(double constant) { return json_pack("{s:f, s:n}", "constant", constant, "texture"); }

static json_t *number_map_json(double constant, double factor, const struct texture_maps *m, const char *file)
{
    return json_pack("{s:f, s:{s:f, s:f, s:o}}", "constant", constant, "texture", "factor", factor, "offset", 0.0,
                     "image", image_json(m, file));
}

static json_t *rgb_json(const double rgb[3])
{
    return json_pack("{s:f, s:f, s:f}", "r", rgb[0], "g", rgb[1], "b", rgb[2]);
}

static json_t *color_map_json(const double rgb[3], const struct texture_maps *m, const char *file)
{
    static const double one[3] = {1.0, 1.0, 1.0};
    return json_pack("{s:o, s:{s:s, s:o, s:o}}", "constant", rgb_json(rgb), "texture", "mode", "multiply", "factor",
                     rgb_json(one), "image", image_json(m, file));
}

static json_t *normal_json(const struct texture_maps *m, const char *file, double scale)
{
    json_t *j = json_pack("{s:{s:f, s:f, s:f}, s:n}", "constant", "x", 0.0, "y", 0.0, "z", 1.0, "texture");
    if (file != NULL)
        json_object_set_new(j, "texture", json_pack("{s:f, s:o}", "scale", scale, "image", image_json(m, file)));
    return j;
}

/* Sets the keys without a map to the values of a plain dielectric without coat and metal. */
static void add_rest(json_t *v)
{
    static const char *const zero[] = {"clearcoat_value", "clearcoat_roughness", "metalness",
                                       "specular_tint",   "subsurface_radius",   "subsurface_value"};
    static const double white[3] = {1.0, 1.0, 1.0};
    for (size_t i = 0; i < sizeof zero / sizeof zero[0]; i++) json_object_set_new(v, zero[i], number_json(0.0));
    json_object_set_new(v, "ior", number_json(1.5));
    json_object_set_new(v, "clearcoat_normal", normal_json(NULL, NULL, 1.0));
    json_object_set_new(v, "subsurface_color", json_pack("{s:o, s:n}", "constant", rgb_json(white), "texture"));
    json_object_set_new(v, "shader", json_string("principled"));
}

static double mean_of(const struct texture_principled *p, double (*value)(const struct texture_principled *, size_t))
{
    double sum = 0.0;
    const size_t n = p->maps->width * p->maps->height;
    for (size_t i = 0; i < n; i++) sum += value(p, i);
    return sum / (double)n;
}

static double mean_height_mm(const struct export_scene *e, const struct texture_maps *m)
{
    double sum = 0.0;
    const size_t n = m->width * m->height;
    for (size_t i = 0; i < n; i++) sum += (double)m->height_mm[i];
    return sum / (double)n + texture_height_range_mm(e);
}

/* Heights are millimetres above the lowest place. */
static json_t *front_json(const struct export_scene *e, const struct texture_principled *p)
{
    const struct texture_maps *m = p->maps;
    const double *through = p->means.transmission;
    json_t *v = json_object();
    add_rest(v);
    json_object_set_new(v, "basecolor", color_map_json(p->base, m, "principled_base_color.png"));
    json_object_set_new(v, "normal", normal_json(m, "normal.png", p->normal_scale));
    json_object_set_new(v, "roughness",
                        number_map_json(mean_of(p, texture_principled_roughness), 1.0, m, "principled_roughness.png"));
    json_object_set_new(
        v, "anisotropy_value",
        number_map_json(mean_of(p, texture_principled_anisotropy), 1.0, m, "principled_anisotropy.png"));
    json_object_set_new(v, "anisotropy_rotation", number_map_json(0.0, 1.0, m, "anisotropy_rotation.png"));
    json_object_set_new(
        v, "transmission",
        number_map_json(fmin((through[0] + through[1] + through[2]) / 3.0, 1.0), 1.0, m, "transmission.png"));
    json_object_set_new(v, "displacement",
                        number_map_json(mean_height_mm(e, m), texture_height_range_mm(e), m, "height.png"));
    json_object_set_new(v, "alpha",
                        m->cut_out ? number_map_json(texture_maps_cover(m), 1.0, m, "opacity.png") : number_json(1.0));
    json_object_set_new(v, "preview", preview_json(m));
    json_object_set_new(v, "specular_value", number_json(p->specular));
    json_object_set_new(v, "sheen_value", number_json(p->sheen));
    json_object_set_new(v, "sheen_tint", number_json(p->sheen_tint));
    return v;
}

/* A word of U3M's list for a described cloth, which is woven; null for other cloths, which may be knitted. */
static json_t *woven_json(const struct export_scene *e)
{
    const struct job_cloth *cloth = e->report->in.job->cloth;
    return cloth->description != NULL ? json_pack("{s:s, s:n}", "type", "Woven", "name") : json_null();
}

/* Fibers whose names are in U3M's list, in any case of letters, and others by their name. */
static json_t *composition_json(const struct export_scene *e)
{
    static const char *const word[] = {"Acetate",      "Acrylic", "Alpaca",   "Angora", "Aramid",  "Cashmere",
                                       "Cotton",       "Cupro",   "Elastane", "Hemp",   "Jute",    "Linen",
                                       "Lycra",        "Lyocell", "Modal",    "Mohair", "Nylon",   "Polyester",
                                       "Polyethylene", "Ramie",   "Rayon",    "Silk",   "Spandex", "Wool"};
    struct fiber_composition c;
    if (fiber_composition_read(e->report->in.job->cloth->composition, &c, NULL) != STATUS_OK || c.n_part == 0)
        return json_null();
    json_t *parts = json_array();
    for (size_t i = 0; i < c.n_part; i++) {
        const char *known = NULL;
        for (size_t k = 0; k < sizeof word / sizeof *word; k++)
            if (strcasecmp(word[k], c.part[i].name) == 0) known = word[k];
        json_array_append_new(parts, known != NULL
                                         ? json_pack("{s:f, s:s, s:n}", "ratio", c.part[i].share, "type", known, "name")
                                         : json_pack("{s:f, s:s, s:s}", "ratio", c.part[i].share, "type", "other",
                                                     "name", c.part[i].name));
    }
    return json_pack("{s:o}", "parts", parts);
}

static json_t *weight_json(const struct export_scene *e)
{
    const double weight = e->report->in.job->cloth->weight_g_m2;
    return isnan(weight) ? json_null() : json_real(weight);
}

static json_t *construction_json(const struct export_scene *e)
{
    static const char *const word[][2] = {{"plain", "Plain weave"}, {"twill", "Twill"}, {"satin", "Satin"}};
    const struct job_cloth *cloth = e->report->in.job->cloth;
    for (size_t i = 0; i < sizeof word / sizeof *word; i++)
        if (strcmp(cloth->weave, word[i][0]) == 0) return json_pack("{s:s, s:n}", "type", word[i][1], "name");
    return cloth->weave[0] != '\0' ? json_pack("{s:s, s:s}", "type", "other", "name", cloth->weave) : json_null();
}

/* UUID version 4 from the job's inputs, so that the same job gives the same id. */
static void make_uuid(const struct export_scene *e, char text[37])
{
    uint64_t a = e->report->in.job->tools->fingerprint * 0x9e3779b97f4a7c15u,
             b = (e->report->in.job->tools->fingerprint ^ e->report->in.job->seed) * 0xbf58476d1ce4e5b9u;
    snprintf(text, 37, "%08x-%04x-4%03x-%04x-%012llx", (unsigned)(a >> 32), (unsigned)(a >> 16 & 0xffff),
             (unsigned)(a & 0xfff), (unsigned)(0x8000 | (b >> 48 & 0x3fff)), (unsigned long long)(b & 0xffffffffffffu));
}

static json_t *u3m_json(const struct export_scene *e, const struct texture_principled *p)
{
    char uuid[37], now[32] = "1970-01-01T00:00:00Z";
    time_t clock = time(NULL);
    struct tm utc;
    if (gmtime_r(&clock, &utc) != NULL) strftime(now, sizeof now, "%Y-%m-%dT%H:%M:%SZ", &utc);
    make_uuid(e, uuid);
    return json_pack(
        "{s:s, s:{s:s, s:s, s:s, s:s, s:s, s:o, s:n, s:n, s:{s:f, s:o, s:o, s:{s:s}, s:o, s:o}, s:n}, s:n}", "schema",
        "1.1", "material", "id", uuid, "name", e->report->in.sample[0] != '\0' ? e->report->in.sample : "cloth",
        "description", "Made by Selvedge.", "created", now, "modified", now, "front", front_json(e, p), "back", "side",
        "physics", "thickness", 1e3 * (e->z_high_m - e->z_low_m), "weight", weight_json(e), "composition",
        composition_json(e), "devices", "fab", "null", "material_type", woven_json(e), "construction",
        construction_json(e), "metadata", "custom");
}

status texture_u3m_write(const struct export_scene *e, const struct texture_principled *p, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text;
    json_t *json = u3m_json(e, p);
    text = json != NULL ? json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(json);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write a U3M material: out of memory");
    export_path(e, "cloth.u3m", path);
    status s = worker_folder_replace(e->report->in.job->tools->folder, path, text, strlen(text), err);
    free(text);
    return s;
}
