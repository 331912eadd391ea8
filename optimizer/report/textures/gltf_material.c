#include "optimizer/report/textures/gltf_material.h"

#include "optimizer/job/document/json_number.h"
#include "renderer/image/image.h"

#include <math.h>
#include <stdlib.h>

static const double index_of_refraction = 1.5, straight = 0.04; /* what that index reflects of light from straight */
static const double most_through = 0.98;

/* Maps of both materials; base color of the first and of the second, and what the second lets through: its color, and
 * its share as a fourth channel. */
enum map { NORMAL, ROUGHNESS, BASE, BASE_BELOW, THROUGH, N_MAP };
static const char *const map_name[N_MAP] = {"normal", "metallic_roughness", "base_color", "base_color_of_two",
                                            "transmission"};

static uint8_t byte_of(double share) { return (uint8_t)lround(255.0 * fmin(fmax(share, 0.0), 1.0)); }

static uint8_t signed_byte(double x) { return byte_of(0.5 * (x + 1.0)); }

/* Share of the light below the microfacets that goes through at pixel i. */
static double share_through(const struct texture_tile *t, size_t i)
{
    const float *rgb = t->transmitted.pixel + 3 * i;
    return fmin((double)fmaxf(fmaxf(rgb[0], rgb[1]), rgb[2]), most_through);
}

/* Channel c of a pixel. Rows from the top; x to the right and y up, as the tangents of the meshes. Base color in
 * proportion to the picture, so that the mean is right in spite of the noise of dark pixels. */
static uint8_t value_of(const struct gltf_surface *g, const struct texture_tile *t, enum map map, size_t i, size_t c)
{
    const double base = (double)t->reflected.pixel[3 * i + c % 3] / fmax(g->means.albedo[c % 3], 1e-9) * g->base[c % 3],
                 through = share_through(t, i);
    switch (map) {
    case NORMAL:
        return signed_byte((double)t->maps.normal[3 * i + c]);
    case ROUGHNESS:
        return byte_of(c == 1 ? gltf_surface_roughness(g, i) : c == 0 ? 1.0 : 0.0);
    case BASE:
        return image_srgb_byte(base);
    case BASE_BELOW:
        return image_srgb_byte(base / (1.0 - through));
    default:
        return c == 3 ? byte_of(through)
                      : image_srgb_byte((double)t->transmitted.pixel[3 * i + c] / fmax(through, 1e-9));
    }
}

static json_t *texture(json_int_t index) { return json_pack("{s:I, s:i}", "index", index, "texCoord", 0); }

static json_t *extensions_of(const struct gltf_surface *g, const json_int_t map[N_MAP], bool lets_through)
{
    json_t *e =
        json_pack("{s:{s:f}, s:{s:f, s:o}, s:{s:f, s:f}, s:{s:o, s:f}, s:{s:f, s:f}}", "KHR_materials_ior", "ior",
                  index_of_refraction, "KHR_materials_specular", "specularFactor", g->f90, "specularColorFactor",
                  json_number_list(g->f0, 3, 1.0 / (g->f90 * straight)), "KHR_materials_anisotropy",
                  "anisotropyStrength", g->anisotropy, "anisotropyRotation", g->rotation_rad, "KHR_materials_sheen",
                  "sheenColorFactor", json_number_list(g->sheen, 3, 1.0), "sheenRoughnessFactor", g->sheen_roughness,
                  "KHR_materials_clearcoat", "clearcoatFactor", g->coat, "clearcoatRoughnessFactor", g->coat_roughness);
    if (lets_through)
        json_object_set_new(e, "KHR_materials_diffuse_transmission",
                            json_pack("{s:f, s:o, s:[f, f, f], s:o}", "diffuseTransmissionFactor", 1.0,
                                      "diffuseTransmissionTexture", texture(map[THROUGH]),
                                      "diffuseTransmissionColorFactor", 1.0, 1.0, 1.0,
                                      "diffuseTransmissionColorTexture", texture(map[THROUGH])));
    return e;
}

static json_t *material_json(const struct gltf_surface *g, const json_int_t map[N_MAP], bool lets_through)
{
    json_t *normal = texture(map[NORMAL]);
    json_object_set_new(normal, "scale", json_real(1.0));
    return json_pack("{s:s, s:{s:[f, f, f, f], s:o, s:f, s:f, s:o}, s:o, s:[f, f, f], s:s, s:b, s:o}", "name",
                     lets_through ? "cloth that lets light through" : "cloth", "pbrMetallicRoughness",
                     "baseColorFactor", 1.0, 1.0, 1.0, 1.0, "baseColorTexture",
                     texture(map[lets_through ? BASE_BELOW : BASE]), "metallicFactor", 0.0, "roughnessFactor", 1.0,
                     "metallicRoughnessTexture", texture(map[ROUGHNESS]), "normalTexture", normal, "emissiveFactor",
                     0.0, 0.0, 0.0, "alphaMode", "OPAQUE", "doubleSided", 1, "extensions",
                     extensions_of(g, map, lets_through));
}

status gltf_material_add(const struct gltf_surface *g, const struct texture_tile *tile, struct glb_file *file,
                         json_t **materials, struct error *err)
{
    const size_t n = tile->maps.width * tile->maps.height;
    json_int_t map[N_MAP];
    const size_t size[2] = {tile->maps.width, tile->maps.height};
    uint8_t *pixel = malloc(4 * n);
    if (pixel == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write a glTF material: out of memory");
    for (enum map k = NORMAL; k < N_MAP; k++) {
        const size_t n_channel = k == THROUGH ? 4 : 3;
        for (size_t i = 0; i < n * n_channel; i++) pixel[i] = value_of(g, tile, k, i / n_channel, i % n_channel);
        map[k] = glb_add_texture(file, map_name[k], pixel, size, n_channel);
    }
    free(pixel);
    *materials = json_pack("[o, o]", material_json(g, map, false), material_json(g, map, true));
    return STATUS_OK;
}

json_t *gltf_material_variants(void)
{
    return json_pack("{s:{s:[{s:s}, {s:s}]}}", "KHR_materials_variants", "variants", "name", "reflected light", "name",
                     "reflected and transmitted light");
}

json_t *gltf_material_extensions(void)
{
    return json_pack("[s, s, s, s, s, s, s]", "KHR_materials_clearcoat", "KHR_materials_ior", "KHR_materials_specular",
                     "KHR_materials_anisotropy", "KHR_materials_sheen", "KHR_materials_diffuse_transmission",
                     "KHR_materials_variants");
}

json_t *gltf_material_mappings(void)
{
    return json_pack("{s:{s:[{s:i, s:[i]}, {s:i, s:[i]}]}}", "KHR_materials_variants", "mappings", "material", 0,
                     "variants", 0, "material", 1, "variants", 1);
}
