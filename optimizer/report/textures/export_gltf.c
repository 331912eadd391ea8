/* results/export/gltf/: the fitted cloth as glTF 2.0 binary files, drape.glb and sphere.glb: a draped piece and a ball,
 * with textures of one tile that repeat in true size (gltf_material.h). Metres. rows.csv as of the other formats. */
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/report/textures/gltf_material.h"
#include "optimizer/report/textures/gltf_mesh.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double mm = 1e3, percent = 100.0, most_error = 0.1;

enum { TILE_PX = 256 }; /* of the tile's longer edge */

struct gltf {
    struct export_scene *e;
    struct texture_tile tile;
    struct gltf_surface surface;
    double tile_mm[2];
};

/* About the sample, for people and programs that look for it. */
static json_t *extras_json(const struct gltf *f)
{
    const struct export_scene *e = f->e;
    json_t *json =
        json_pack("{s:s, s:s, s:o, s:f, s:o}", "sample", e->report->in.sample, "model", e->model->setup->appearance.id,
                  "tile_mm", json_number_list(f->tile_mm, 2, 1.0), "thickness_mm", mm * (e->z_high_m - e->z_low_m),
                  "row_rel_rms", json_number(f->surface.error.row_rel_rms));
    const struct job_cloth *cloth = e->report->in.job->cloth;
    if (cloth->composition[0] != '\0') json_object_set_new(json, "composition", json_string(cloth->composition));
    if (!isnan(cloth->weight_g_m2)) json_object_set_new(json, "weight_g_m2", json_real(cloth->weight_g_m2));
    return json;
}

static json_t *primitive_json(const struct gltf_mesh *m, struct glb_file *file)
{
    const json_int_t position = glb_add_vectors(file, m->position_m, m->n_vertex, 3),
                     normal = glb_add_vectors(file, m->normal, m->n_vertex, 3),
                     tangent = glb_add_vectors(file, m->tangent, m->n_vertex, 4),
                     place = glb_add_vectors(file, m->texture, m->n_vertex, 2);
    return json_pack("{s:{s:I, s:I, s:I, s:I}, s:I, s:i, s:i, s:o}", "attributes", "POSITION", position, "NORMAL",
                     normal, "TANGENT", tangent, "TEXCOORD_0", place, "indices",
                     glb_add_corners(file, m->corner, m->n_corner), "material", 0, "mode", 4, "extensions",
                     gltf_material_mappings());
}

static json_t *document_json(const struct gltf *f, const char *name, json_t *primitive, json_t *materials)
{
    const char *sample = f->e->report->in.sample[0] != '\0' ? f->e->report->in.sample : "cloth";
    return json_pack("{s:{s:s, s:s, s:o}, s:o, s:o, s:i, s:[{s:s, s:[i]}], s:[{s:s, s:i}], s:[{s:s, s:[o]}], s:o}",
                     "asset", "version", "2.0", "generator", "Selvedge", "extras", extras_json(f), "extensionsUsed",
                     gltf_material_extensions(), "extensions", gltf_material_variants(), "scene", 0, "scenes", "name",
                     sample, "nodes", 0, "nodes", "name", name, "mesh", 0, "meshes", "name", name, "primitives",
                     primitive, "materials", materials);
}

static status write_file(const struct gltf *f, const char *name, const struct gltf_mesh *m, struct error *err)
{
    struct glb_file file;
    char path[WORKER_PATH_BYTES], file_name[32];
    uint8_t *bytes = NULL;
    size_t n_byte = 0;
    json_t *materials = NULL;
    glb_init(&file);
    snprintf(file_name, sizeof file_name, "%s.glb", name);
    export_path(f->e, file_name, path);
    status s = gltf_material_add(&f->surface, &f->tile, &file, &materials, err);
    if (s == STATUS_OK)
        s = glb_bytes(&file, document_json(f, name, primitive_json(m, &file), materials), &bytes, &n_byte, err);
    if (s == STATUS_OK)
        s = worker_folder_replace(f->e->report->in.job->tools->folder, path, (char *)bytes, n_byte, err);
    free(bytes);
    glb_release(&file);
    return s;
}

static status write_files(const struct gltf *f, struct error *err)
{
    const struct progress silent = progress_silent(f->e->progress);
    struct gltf_mesh drape = {0}, ball = {0};
    status s = gltf_mesh_drape(f->tile_mm, &silent, &drape, err);
    if (s == STATUS_OK) s = write_file(f, "drape", &drape, err);
    if (s == STATUS_OK) s = gltf_mesh_ball(f->tile_mm, &ball, err);
    if (s == STATUS_OK) s = write_file(f, "sphere", &ball, err);
    gltf_mesh_release(&drape);
    gltf_mesh_release(&ball);
    return s;
}

static json_t *materials_json(const struct gltf *f)
{
    const struct gltf_surface *g = &f->surface;
    return json_pack("[{s:n, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}]", "group",
                     "f0", json_number_list(g->f0, 3, 1.0), "f90", json_number(g->f90), "roughness",
                     json_number(g->roughness), "anisotropy", json_number(g->anisotropy), "anisotropy_rotation",
                     json_number(g->rotation_rad), "base_color", json_number_list(g->base, 3, 1.0), "sheen_color",
                     json_number_list(g->sheen, 3, 1.0), "sheen_roughness", json_number(g->sheen_roughness), "coat",
                     json_number(g->coat), "coat_roughness", json_number(g->coat_roughness), "transmission",
                     json_number_list(g->means.transmission, 3, 1.0), "pixel_rel_se",
                     json_number(f->tile.noise[0].rel_se), "normal_scale", json_number(g->normal_scale), "afar_rel_rms",
                     json_number(g->error.afar_rel_rms), "rel_rms", json_number(g->error.rel_rms), "heldout_rel_rms",
                     json_number(g->error.heldout_rel_rms));
}

/* The scene owns the errors of rows then. */
static void state_error(struct gltf *f)
{
    struct texture_error *error = &f->surface.error;
    f->e->own_error = (struct hair_error){.stated = true,
                                          .rel_rms = error->hemisphere_rel_rms,
                                          .row_rel_rms = error->row_rel_rms,
                                          .row_rel_error = error->row_rel_error};
    error->row_rel_error = NULL;
    if (error->row_rel_rms > most_error)
        worker_status_warn(f->e->report->in.job->tools->status,
                           "as a glTF material, the cloth differs from this job's renderings by %.0f %% over its rows",
                           percent * error->row_rel_rms);
}

static status write_gltf(struct export_scene *e, json_t **materials, struct error *err)
{
    struct gltf f = {.e = e};
    struct texture_target target = {0};
    for (size_t a = 0; a < 2; a++) f.tile_mm[a] = mm * e->report->in.made->fiber.tile_size_m[a];
    const struct texture_size size = texture_size_of(f.tile_mm, 0.0, TILE_PX);
    status s = texture_tile_make(e, size.tile_px, &f.tile, err);
    f.surface.maps = &f.tile.maps;
    f.surface.means = f.tile.means;
    if (s == STATUS_OK) s = texture_target_make(e, TEXTURE_TILE_SHARE, 1.0, &target, err);
    if (s == STATUS_OK) s = gltf_surface_fit(&f.surface, &f.tile.maps, &target, err);
    if (s == STATUS_OK) s = export_rows_write(e, err);
    if (s == STATUS_OK) s = write_files(&f, err);
    if (s == STATUS_OK) *materials = materials_json(&f);
    if (s == STATUS_OK) state_error(&f);
    gltf_surface_release(&f.surface);
    texture_target_release(&target);
    texture_tile_release(&f.tile);
    return s;
}

EXPORT(gltf, "A draped piece and a ball as glTF 2.0 (.glb) for web pages and viewers, with textures in true size.")

const struct export_format export_gltf = {.write = write_gltf, .paths = texture_tile_paths};
