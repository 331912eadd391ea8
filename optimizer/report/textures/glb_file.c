#include "optimizer/report/textures/glb_file.h"

#include "renderer/image/image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    FLOAT = 5126,
    UNSIGNED_SHORT = 5123,
    VERTICES = 34962,
    CORNERS = 34963,
    LINEAR = 9729,
    MIPMAPS = 9987,
    REPEAT = 10497
};
enum { HEADER_BYTES = 12, CHUNK_BYTES = 8 };
static const uint32_t magic = 0x46546c67, json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;

void glb_init(struct glb_file *g)
{
    *g = (struct glb_file){json_array(), json_array(), json_array(), json_array(), NULL, 0, true};
}

void glb_release(struct glb_file *g)
{
    json_decref(g->views);
    json_decref(g->accessors);
    json_decref(g->images);
    json_decref(g->textures);
    free(g->block);
    memset(g, 0, sizeof *g);
}

static json_int_t append(struct glb_file *g, json_t *list, json_t *entry)
{
    g->whole = json_array_append_new(list, entry) == 0 && g->whole;
    return (json_int_t)json_array_size(list) - 1;
}

/* Parts begin at multiples of four bytes. target: of the view, or 0. */
static json_int_t add_view(struct glb_file *g, const void *data, size_t n_byte, int target)
{
    const size_t padded = (n_byte + 3) / 4 * 4;
    uint8_t *block = realloc(g->block, g->n_byte + padded + 1);
    if (block == NULL) {
        g->whole = false;
        return 0;
    }
    memset(block + g->n_byte, 0, padded);
    memcpy(block + g->n_byte, data, n_byte);
    json_t *view = json_pack("{s:i, s:I, s:I}", "buffer", 0, "byteOffset", (json_int_t)g->n_byte, "byteLength",
                             (json_int_t)n_byte);
    if (target != 0) json_object_set_new(view, "target", json_integer(target));
    g->block = block;
    g->n_byte += padded;
    return append(g, g->views, view);
}

json_int_t glb_add_vectors(struct glb_file *g, const float *value, size_t n, size_t n_component)
{
    static const char *const type[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    const json_int_t view = add_view(g, value, n * n_component * sizeof *value, VERTICES);
    json_t *low = json_array(), *high = json_array();
    for (size_t c = 0; c < n_component; c++) {
        float least = INFINITY, most = -INFINITY;
        for (size_t i = 0; i < n; i++) {
            least = fminf(least, value[n_component * i + c]);
            most = fmaxf(most, value[n_component * i + c]);
        }
        append(g, low, json_real((double)least));
        append(g, high, json_real((double)most));
    }
    return append(g, g->accessors,
                  json_pack("{s:I, s:i, s:I, s:s, s:o, s:o}", "bufferView", view, "componentType", FLOAT, "count",
                            (json_int_t)n, "type", type[n_component - 1], "min", low, "max", high));
}

json_int_t glb_add_corners(struct glb_file *g, const uint16_t *corner, size_t n)
{
    const json_int_t view = add_view(g, corner, n * sizeof *corner, CORNERS);
    return append(g, g->accessors,
                  json_pack("{s:I, s:i, s:I, s:s}", "bufferView", view, "componentType", UNSIGNED_SHORT, "count",
                            (json_int_t)n, "type", "SCALAR"));
}

json_int_t glb_add_texture(struct glb_file *g, const char *name, const uint8_t *pixel, const size_t size[2],
                           size_t n_channel)
{
    uint8_t *png = NULL;
    size_t n_byte = 0;
    if (image_png_bytes(pixel, size[0], size[1], n_channel, &png, &n_byte, NULL) != STATUS_OK) {
        g->whole = false;
        return 0;
    }
    const json_int_t view = add_view(g, png, n_byte, 0);
    free(png);
    const json_int_t image =
        append(g, g->images, json_pack("{s:s, s:s, s:I}", "name", name, "mimeType", "image/png", "bufferView", view));
    return append(g, g->textures, json_pack("{s:i, s:I}", "sampler", 0, "source", image));
}

static void put_word(uint8_t *at, uint32_t word)
{
    for (int k = 0; k < 4; k++) at[k] = (uint8_t)(word >> (8 * k));
}

static json_t *move_lists(struct glb_file *g, json_t *document)
{
    json_object_set(document, "bufferViews", g->views);
    json_object_set(document, "accessors", g->accessors);
    json_object_set(document, "images", g->images);
    json_object_set(document, "textures", g->textures);
    json_object_set_new(document, "samplers",
                        json_pack("[{s:i, s:i, s:i, s:i}]", "magFilter", LINEAR, "minFilter", MIPMAPS, "wrapS", REPEAT,
                                  "wrapT", REPEAT));
    json_object_set_new(document, "buffers", json_pack("[{s:I}]", "byteLength", (json_int_t)g->n_byte));
    return document;
}

status glb_bytes(struct glb_file *g, json_t *document, uint8_t **bytes, size_t *n_byte, struct error *err)
{
    char *text = g->whole && document != NULL ? json_dumps(move_lists(g, document), JSON_COMPACT) : NULL;
    const size_t length = text != NULL ? strlen(text) : 0, padded = (length + 3) / 4 * 4;
    json_decref(document);
    *n_byte = HEADER_BYTES + CHUNK_BYTES + padded + CHUNK_BYTES + g->n_byte;
    *bytes = text != NULL ? malloc(*n_byte) : NULL;
    if (*bytes == NULL) {
        free(text);
        return error_set(err, STATUS_NO_MEMORY, "cannot write a glTF file: out of memory");
    }
    uint8_t *at = *bytes;
    put_word(at, magic);
    put_word(at + 4, 2);
    put_word(at + 8, (uint32_t)*n_byte);
    at += HEADER_BYTES;
    put_word(at, (uint32_t)padded);
    put_word(at + 4, json_chunk);
    memset(at + CHUNK_BYTES, ' ', padded);
    memcpy(at + CHUNK_BYTES, text, length);
    at += CHUNK_BYTES + padded;
    put_word(at, (uint32_t)g->n_byte);
    put_word(at + 4, binary_chunk);
    memcpy(at + CHUNK_BYTES, g->block, g->n_byte);
    free(text);
    return STATUS_OK;
}
