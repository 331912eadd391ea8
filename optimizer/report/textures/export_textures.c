/* results/export/textures/: one tile of the fitted cloth as a texture set, for programs that want a material only.
 * base_color.png and transmission.png (sRGB; light reflected and let through under even light from above, rendered
 * from the fibers), normal.png, roughness.png, anisotropy.png, anisotropy_rotation.png (plain numbers; the
 * rotation in turns, of the direction across the fibers), maps.exr (all of them as floats, with the height),
 * cloth.mtlx and cloth.u3m (texture_documents.h). Of the parameters, texture_surface.h. */
#include "base/files/durable.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/report/export/export_scene.h"
#include "optimizer/report/textures/texture_documents.h"
#include "optimizer/report/textures/texture_tile.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { N_CHANNEL = 18 };
static const double percent = 100.0, most_row_error = 0.1; /* of a cloth that is exported without a warning */
static const char *const channel[N_CHANNEL] = {"R",
                                               "G",
                                               "B",
                                               "transmission.R",
                                               "transmission.G",
                                               "transmission.B",
                                               "N.X",
                                               "N.Y",
                                               "N.Z",
                                               "roughness",
                                               "anisotropy",
                                               "direction_rad",
                                               "height_mm",
                                               "principled.R",
                                               "principled.G",
                                               "principled.B",
                                               "principled.roughness",
                                               "principled.anisotropy"};

struct textures {
    struct export_scene *e;
    struct texture_tile tile;
    struct texture_surface surface;
    struct texture_principled principled;
};

/* ---- files ---- */

enum picture_kind { PICTURE_SRGB, PICTURE_NUMBERS, PICTURE_EXR };

static status write_picture(const struct textures *t, const struct image *im, const char *name, enum picture_kind kind,
                            struct error *err)
{
    char path[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES], partial[64];
    snprintf(partial, sizeof partial, "part-%s", name);
    export_path(t->e, name, path);
    export_path(t->e, partial, part);
    status s = STATUS_OK;
    if (kind == PICTURE_SRGB) s = image_write_png(im, 1.0, part, err);
    if (kind == PICTURE_EXR) s = image_write_exr(im, part, err);
    if (kind == PICTURE_NUMBERS) {
        uint8_t *rgb = malloc(3 * im->width * im->height);
        if (rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write textures: out of memory");
        for (size_t i = 0; i < 3 * im->width * im->height; i++)
            rgb[i] = (uint8_t)lround(255.0 * fmin(fmax((double)im->pixel[i], 0.0), 1.0));
        s = image_write_png_rgb8(rgb, im->width, im->height, part, err);
        free(rgb);
    }
    if (s == STATUS_OK) s = worker_folder_check(t->e->report->in.job->tools->folder, err);
    if (s == STATUS_OK) return durable_rename(part, path, err);
    unlink(part);
    return s;
}

/* All maps of pixel i, in the order of `channel`. */
static void pixel_of(const struct textures *t, size_t i, float out[N_CHANNEL])
{
    for (size_t c = 0; c < 3; c++) {
        /* in proportion, so that the mean is right in spite of the noise of dark pixels */
        const double share = (double)t->tile.reflected.pixel[3 * i + c] / fmax(t->tile.means.albedo[c], 1e-9);
        out[c] = (float)(share * t->surface.base[c]);
        out[3 + c] = t->tile.transmitted.pixel[3 * i + c];
        out[6 + c] = t->tile.maps.normal[3 * i + c];
        out[13 + c] = (float)(share * t->principled.base[c]);
    }
    out[9] = (float)texture_surface_roughness(&t->surface, i);
    out[10] = (float)texture_surface_anisotropy(&t->surface, i);
    out[16] = (float)texture_principled_roughness(&t->principled, i);
    out[17] = (float)texture_principled_anisotropy(&t->principled, i);
    out[11] = t->tile.maps.direction_rad[i];
    out[12] = t->tile.maps.height_mm[i];
}

/* Turns from +x to the direction across the fibers, which has no sign: in [0.125, 0.625), so that the angles of weft
 * and warp are not next to the step. */
static float rotation_turns(float direction_rad)
{
    double turns = ((double)direction_rad + M_PI_2) / (2.0 * M_PI);
    return (float)(turns >= 0.625 ? turns - 0.5 : turns);
}

/* One PNG of channels [first, first + n) as numbers of [0, 1]; one channel becomes grey. */
static status write_map(const struct textures *t, const struct image *all, size_t first, size_t n, const char *name,
                        struct error *err)
{
    struct image im;
    status s = image_init(&im, all->width, all->height, 3, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < im.width * im.height; i++)
        for (size_t c = 0; c < 3; c++) {
            float value = all->pixel[i * N_CHANNEL + first + (n == 3 ? c : 0)];
            if (first == 6) value = 0.5f * (value + 1.0f);
            if (first == 11) value = rotation_turns(value);
            im.pixel[3 * i + c] = value;
        }
    s = write_picture(t, &im, name, first < 6 || first == 13 ? PICTURE_SRGB : PICTURE_NUMBERS, err);
    image_release(&im);
    return s;
}

static status write_maps(const struct textures *t, struct error *err)
{
    static const struct {
        size_t first, n;
        const char *name;
    } map[] = {{0, 3, "base_color.png"},
               {3, 3, "transmission.png"},
               {6, 3, "normal.png"},
               {9, 1, "roughness.png"},
               {10, 1, "anisotropy.png"},
               {11, 1, "anisotropy_rotation.png"},
               {13, 3, "principled_base_color.png"},
               {16, 1, "principled_roughness.png"},
               {17, 1, "principled_anisotropy.png"}};
    struct image all;
    status s = image_init(&all, t->tile.maps.width, t->tile.maps.height, N_CHANNEL, err);
    if (s != STATUS_OK) return s;
    all.channel_name = channel;
    for (size_t i = 0; i < all.width * all.height; i++) pixel_of(t, i, all.pixel + i * N_CHANNEL);
    s = write_picture(t, &all, "maps.exr", PICTURE_EXR, err);
    for (size_t i = 0; i < sizeof map / sizeof map[0] && s == STATUS_OK; i++)
        s = write_map(t, &all, map[i].first, map[i].n, map[i].name, err);
    image_release(&all);
    return s;
}

static void put_error(json_t *json, const struct texture_error *error, size_t n_row)
{
    json_object_set_new(json, "rel_rms", json_number(error->rel_rms));
    json_object_set_new(json, "heldout_rel_rms", json_number(error->heldout_rel_rms));
    json_object_set_new(json, "row_rel_rms", json_number(error->row_rel_rms));
    json_object_set_new(json, "hemisphere_rel_rms", json_number(error->hemisphere_rel_rms));
    json_object_set_new(json, "row_rel_errors", json_number_list(error->row_rel_error, n_row, 1.0));
}

static json_t *principled_json(const struct texture_principled *p, size_t n_row)
{
    json_t *json = json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "specular", json_number(p->specular), "roughness",
                             json_number(p->roughness), "anisotropy", json_number(p->anisotropy), "base_color",
                             json_number_list(p->base, 3, 1.0), "sheen", json_number(p->sheen), "sheen_tint",
                             json_number(p->sheen_tint), "normal_scale", json_number(p->normal_scale));
    put_error(json, &p->error, n_row);
    return json;
}

static json_t *open_pbr_json(const struct texture_surface *u)
{
    const struct texture_open_pbr in = texture_surface_inputs(u);
    return json_pack("{s:n, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "group", "specular_ior",
                     json_number(in.specular_ior), "specular_weight", json_number(in.specular_weight), "specular_color",
                     json_number_list(u->specular_color, 3, 1.0), "specular_roughness", json_number(u->roughness),
                     "specular_anisotropy", json_number(u->anisotropy), "base_color", json_number_list(u->base, 3, 1.0),
                     "fuzz", json_number_list(u->fuzz, 3, 1.0), "fuzz_roughness", json_number(u->fuzz_roughness),
                     "coat_weight", json_number(u->coat_weight), "coat_roughness", json_number(u->coat_roughness),
                     "normal_scale", json_number(u->normal_scale));
}

static json_t *material_json(const struct textures *t)
{
    const size_t n_row = t->e->report->in.job->rows->observation.n;
    json_t *json = open_pbr_json(&t->surface);
    json_object_set_new(json, "albedo", json_number_list(t->tile.means.albedo, 3, 1.0));
    json_object_set_new(json, "transmission", json_number_list(t->tile.means.transmission, 3, 1.0));
    json_object_set_new(json, "pixel_rel_se", json_number(t->tile.noise));
    put_error(json, &t->surface.error, n_row);
    json_object_set_new(json, "principled", principled_json(&t->principled, n_row));
    return json_pack("[o]", json);
}

/* The error of the export is that of its U3M material, whose model is the smaller one. */
static void state_error(struct textures *t)
{
    struct texture_error *error = &t->principled.error;
    const double worst = fmax(error->row_rel_rms, t->surface.error.row_rel_rms);
    t->e->own_error = (struct hair_error){.stated = true,
                                          .rel_rms = error->hemisphere_rel_rms,
                                          .row_rel_rms = error->row_rel_rms,
                                          .row_rel_error = error->row_rel_error};
    error->row_rel_error = NULL; /* the scene owns it now */
    if (worst > most_row_error)
        worker_status_warn(t->e->report->in.job->tools->status,
                           "as a surface with the exported textures, the cloth differs from this job's renderings by "
                           "%.0f %% over its rows as a U3M material and by %.0f %% as an OpenPBR surface",
                           percent * error->row_rel_rms, percent * t->surface.error.row_rel_rms);
}

static status fit_surfaces(struct textures *t, struct error *err)
{
    struct texture_target target = {0};
    t->surface.maps = &t->tile.maps;
    t->surface.means = t->tile.means;
    t->principled.maps = &t->tile.maps;
    t->principled.means = t->tile.means;
    status s = texture_target_make(t->e, TEXTURE_TILE_SHARE, 1.0, &target, err);
    if (s == STATUS_OK) s = texture_surface_fit(&t->surface, &t->tile.maps, &target, err);
    if (s == STATUS_OK) s = texture_principled_fit(&t->principled, &target, err);
    texture_target_release(&target);
    return s;
}

static status write_textures(struct export_scene *e, json_t **materials, struct error *err)
{
    struct textures t = {.e = e};
    status s = texture_tile_make(e, &t.tile, err);
    if (s == STATUS_OK) s = fit_surfaces(&t, err);
    if (s == STATUS_OK) s = write_maps(&t, err);
    if (s == STATUS_OK) s = texture_materialx_write(e, &t.surface, err);
    if (s == STATUS_OK) s = texture_u3m_write(e, &t.principled, err);
    if (s == STATUS_OK) {
        *materials = material_json(&t);
        state_error(&t);
    }
    texture_surface_release(&t.surface);
    texture_principled_release(&t.principled);
    texture_tile_release(&t.tile);
    return s;
}

EXPORT(textures, "Textures of one tile with a MaterialX document (OpenPBR) and a U3M 1.1 material. They have as "
                 "many pixels as the renderings of the job.")

const struct export_format export_textures = {.write = write_textures, .paths = texture_tile_paths};
