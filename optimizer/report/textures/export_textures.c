/* results/export/textures/: one tile of the fitted cloth as a texture set, for programs that want a material only.
 * base_color.png and transmission.png (sRGB; light reflected and let through under even light from above, rendered
 * from the fibers), normal.png, roughness.png, anisotropy.png, anisotropy_rotation.png (plain numbers; the
 * rotation in turns, of the direction across the fibers), maps.exr (all of them as floats, with the height),
 * cloth.mtlx and cloth.u3m (texture_documents.h). Of the parameters, texture_surface.h. */
#include "base/files/durable.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/export/export_scene.h"
#include "optimizer/report/textures/texture_documents.h"
#include "optimizer/report/textures/texture_tile.h"
#include "optimizer/report/textures/texture_usd.h"
#include "optimizer/report/textures/u3ma_file.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Channels of maps.exr. */
enum {
    BASE,
    TRANSMISSION = 3,
    NORMAL = 6,
    ROUGHNESS = 9,
    ANISOTROPY,
    DIRECTION,
    HEIGHT,
    PRINCIPLED_BASE,
    PRINCIPLED_ROUGHNESS = 16,
    PRINCIPLED_ANISOTROPY,
    OPACITY,
    REFLECTED,
    N_CHANNEL = REFLECTED + 3
};
static const double least_holes = 0.995;                   /* cover of a cloth below which it has an opacity */
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
                                               "principled.anisotropy",
                                               "opacity",
                                               "reflected.R",
                                               "reflected.G",
                                               "reflected.B"};

struct textures {
    struct export_scene *e;
    struct texture_tile tile;
    struct texture_surface surface;
    struct texture_principled principled;
};

/* ---- files ---- */

/* Gives a part file that was written as `partial` its name. */
static status publish(const struct textures *t, status s, const char *part, const char *path, struct error *err)
{
    if (s == STATUS_OK) s = worker_folder_check(t->e->report->in.job->tools->folder, err);
    if (s == STATUS_OK) return durable_rename(part, path, err);
    unlink(part);
    return s;
}

static void paths_of(const struct textures *t, const char *name, char path[WORKER_PATH_BYTES],
                     char part[WORKER_PATH_BYTES])
{
    char partial[64];
    snprintf(partial, sizeof partial, "part-%s", name);
    export_path(t->e, name, path);
    export_path(t->e, partial, part);
}

/* All maps of one tile as floats. */
static status write_exr(const struct textures *t, const struct image *all, struct error *err)
{
    char path[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES];
    paths_of(t, "maps.exr", path, part);
    return publish(t, image_write_exr(all, part, err), part, path, err);
}

/* Writes a PNG of the texture: rows of tiles of 3 bytes a pixel. */
static status write_repeated(const struct textures *t, const uint8_t *tile, const char *name, struct error *err)
{
    const struct texture_maps *m = &t->tile.maps;
    const size_t row = 3 * m->width, width = m->width * t->tile.maps.repeat[0],
                 height = m->height * t->tile.maps.repeat[1];
    char path[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES];
    uint8_t *rgb = malloc(3 * width * height);
    if (rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write textures: out of memory");
    for (size_t j = 0; j < height; j++)
        for (size_t k = 0; k < t->tile.maps.repeat[0]; k++)
            memcpy(rgb + 3 * j * width + k * row, tile + j % m->height * row, row);
    paths_of(t, name, path, part);
    status s = publish(t, image_write_png_rgb8(rgb, width, height, part, err), part, path, err);
    free(rgb);
    return s;
}

/* All maps of pixel i, in the order of `channel`. */
static void pixel_of(const struct textures *t, size_t i, float out[N_CHANNEL])
{
    const double opacity = texture_maps_opacity(&t->tile.maps, i),
                 straight = t->tile.maps.cut_out ? 1.0 - (double)t->tile.maps.cover[i] : 0.0;
    for (size_t c = 0; c < 3; c++) {
        /* in proportion, so that the mean is right in spite of the noise of dark pixels */
        const double share = (double)t->tile.maps.share[3 * i + c] / opacity;
        out[BASE + c] = (float)(share * t->surface.base[c]);
        out[REFLECTED + c] = t->tile.reflected.pixel[3 * i + c];
        out[TRANSMISSION + c] = (float)(fmax((double)t->tile.transmitted.pixel[3 * i + c] - straight, 0.0) / opacity);
        out[NORMAL + c] = t->tile.maps.normal[3 * i + c];
        out[PRINCIPLED_BASE + c] = (float)(share * t->principled.base[c]);
    }
    out[ROUGHNESS] = (float)texture_surface_roughness(&t->surface, i);
    out[ANISOTROPY] = (float)texture_surface_anisotropy(&t->surface, i);
    out[PRINCIPLED_ROUGHNESS] = (float)texture_principled_roughness(&t->principled, i);
    out[PRINCIPLED_ANISOTROPY] = (float)texture_principled_anisotropy(&t->principled, i);
    out[DIRECTION] = t->tile.maps.direction_rad[i];
    out[OPACITY] = t->tile.maps.cover[i];
    out[HEIGHT] = t->tile.maps.height_mm[i];
}

/* Turns from +x to the direction across the fibers, which has no sign: in [0.125, 0.625), so that the angles of weft
 * and warp are not next to the step. */
static float rotation_turns(float direction_rad)
{
    double turns = ((double)direction_rad + M_PI_2) / (2.0 * M_PI);
    return (float)(turns >= 0.625 ? turns - 0.5 : turns);
}

static uint8_t byte_of(float value) { return (uint8_t)lround(255.0 * fmin(fmax((double)value, 0.0), 1.0)); }

/* One PNG of channels [first, first + n): colors by the curve of sRGB, others as numbers of [0, 1]; one channel becomes
 * grey. */
static status write_map(const struct textures *t, const struct image *all, size_t first, size_t n, const char *name,
                        struct error *err)
{
    const bool is_color = first < NORMAL || first == PRINCIPLED_BASE || first == REFLECTED;
    const size_t n_px = all->width * all->height;
    uint8_t *tile = malloc(3 * n_px);
    if (tile == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write textures: out of memory");
    for (size_t i = 0; i < 3 * n_px; i++) {
        float value = all->pixel[i / 3 * N_CHANNEL + first + (n == 3 ? i % 3 : 0)];
        if (first == NORMAL) value = 0.5f * (value + 1.0f);
        if (first == DIRECTION) value = rotation_turns(value);
        if (first == HEIGHT) value = 1.0f + value / (float)texture_height_range_mm(t->e);
        tile[i] = is_color ? image_srgb_byte((double)value) : byte_of(value);
    }
    status s = write_repeated(t, tile, name, err);
    free(tile);
    return s;
}

/* The U3M material from straight above, in the light of a lamp on the upper left and in even light. */
static status write_preview(const struct textures *t, struct error *err)
{
    static const double wi[3] = {-0.5, 0.5, M_SQRT1_2}, wo[3] = {0.0, 0.0, 1.0};
    const struct texture_maps *m = &t->tile.maps;
    size_t size[2];
    texture_preview_size(m, size);
    char path[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES];
    uint8_t *rgb = malloc(3 * size[0] * size[1]);
    if (rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write textures: out of memory");
    for (size_t k = 0; k < size[0] * size[1]; k++) {
        const size_t i = k / size[0] % m->height * m->width + k % size[0] % m->width;
        const struct texture_sample s = texture_pixel_sample(m, i, t->principled.normal_scale);
        double lit[3];
        texture_principled_reflect(&t->principled, &s, wi, wo, lit);
        for (size_t c = 0; c < 3; c++)
            rgb[3 * k + c] = image_srgb_byte(0.7 * lit[c] + 0.3 * (double)t->tile.reflected.pixel[3 * i + c]);
    }
    paths_of(t, "preview.png", path, part);
    status s = publish(t, image_write_png_rgb8(rgb, size[0], size[1], part, err), part, path, err);
    free(rgb);
    return s;
}

/* cloth.u3ma: the U3M material with the pictures that it names. */
static status write_archive(const struct textures *t, struct error *err)
{
    static const char *const name[] = {"cloth.u3m",
                                       "preview.png",
                                       "principled_base_color.png",
                                       "normal.png",
                                       "principled_roughness.png",
                                       "principled_anisotropy.png",
                                       "anisotropy_rotation.png",
                                       "transmission.png",
                                       "height.png",
                                       "opacity.png"};
    char path[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES], folder[WORKER_PATH_BYTES];
    const size_t all = sizeof name / sizeof *name, n = t->tile.maps.cut_out ? all : all - 1;
    worker_folder_path(t->e->report->in.job->tools->folder, JOB_FOLDER_RESULTS, t->e->folder, folder);
    paths_of(t, "cloth.u3ma", path, part);
    return publish(t, u3ma_file_write(part, folder, name, n, time(NULL), err), part, path, err);
}

static status write_maps(const struct textures *t, struct error *err)
{
    static const struct {
        size_t first, n;
        const char *name;
    } map[] = {{BASE, 3, "base_color.png"},
               {TRANSMISSION, 3, "transmission.png"},
               {NORMAL, 3, "normal.png"},
               {ROUGHNESS, 1, "roughness.png"},
               {ANISOTROPY, 1, "anisotropy.png"},
               {DIRECTION, 1, "anisotropy_rotation.png"},
               {PRINCIPLED_BASE, 3, "principled_base_color.png"},
               {PRINCIPLED_ROUGHNESS, 1, "principled_roughness.png"},
               {PRINCIPLED_ANISOTROPY, 1, "principled_anisotropy.png"},
               {HEIGHT, 1, "height.png"},
               {OPACITY, 1, "opacity.png"},
               {REFLECTED, 3, "reflected.png"}};
    struct image all;
    status s = image_init(&all, t->tile.maps.width, t->tile.maps.height, N_CHANNEL, err);
    if (s != STATUS_OK) return s;
    all.channel_name = channel;
    for (size_t i = 0; i < all.width * all.height; i++) pixel_of(t, i, all.pixel + i * N_CHANNEL);
    s = write_exr(t, &all, err);
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

static void put_size(const struct textures *t, json_t *json)
{
    const struct texture_maps *m = &t->tile.maps;
    const size_t *repeat = t->tile.maps.repeat;
    json_object_set_new(json, "repeats", json_pack("[I, I]", (json_int_t)repeat[0], (json_int_t)repeat[1]));
    json_object_set_new(json, "size_px",
                        json_pack("[I, I]", (json_int_t)(repeat[0] * m->width), (json_int_t)(repeat[1] * m->height)));
    json_object_set_new(json, "size_mm",
                        json_pack("[f, f]", (double)(repeat[0] * m->width) * m->pixel_mm[0],
                                  (double)(repeat[1] * m->height) * m->pixel_mm[1]));
    json_object_set_new(json, "smoothing_um", json_number(1e3 * t->tile.noise[0].smooth_mm));
}

static json_t *material_json(const struct textures *t)
{
    const size_t n_row = t->e->report->in.job->rows->observation.n;
    json_t *json = open_pbr_json(&t->surface);
    json_object_set_new(json, "albedo", json_number_list(t->tile.means.albedo, 3, 1.0));
    json_object_set_new(json, "transmission", json_number_list(t->tile.means.transmission, 3, 1.0));
    json_object_set_new(json, "pixel_rel_se", json_number(t->tile.noise[0].rel_se));
    json_object_set_new(json, "transmission_pixel_rel_se", json_number(t->tile.noise[1].rel_se));
    json_object_set_new(json, "opacity", json_number(texture_maps_cover(&t->tile.maps)));
    put_size(t, json);
    put_error(json, &t->surface.error, n_row);
    json_object_set_new(json, "principled", principled_json(&t->principled, n_row));
    return json_pack("[o]", json);
}

/* States the error of the U3M material, whose model is the smaller one, as the error of the export. */
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

/* A cloth through which one sees is a surface with holes; what it lets through besides is scattered. */
static void find_holes(struct texture_tile *t)
{
    const double cover = texture_maps_cover(&t->maps);
    t->maps.cut_out = cover < least_holes;
    for (int c = 0; c < 3; c++) t->means.transmission[c] = fmax(t->means.transmission[c] - (1.0 - cover), 0.0);
}

static status write_textures(struct export_scene *e, json_t **materials, struct error *err)
{
    struct textures t = {.e = e};
    const struct texture_size size = texture_size_wanted(e);
    status s = texture_tile_make(e, size.tile_px, &t.tile, err);
    memcpy(t.tile.maps.repeat, size.repeat, sizeof size.repeat);
    if (s == STATUS_OK) find_holes(&t.tile);
    if (s == STATUS_OK) s = fit_surfaces(&t, err);
    if (s == STATUS_OK) s = write_maps(&t, err);
    if (s == STATUS_OK) s = texture_materialx_write(e, &t.surface, err);
    if (s == STATUS_OK) s = texture_usd_write(e, &t.surface, err);
    if (s == STATUS_OK) s = write_preview(&t, err);
    if (s == STATUS_OK) s = texture_u3m_write(e, &t.principled, err);
    if (s == STATUS_OK) s = write_archive(&t, err);
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
