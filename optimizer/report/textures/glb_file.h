/* A glTF 2.0 binary file (GLB) while it is made: the JSON document and the binary block behind it (Khronos 2021, "glTF
 * 2.0 Specification", section 4.4). Indices count from 0, as in the document. */
#ifndef SELVEDGE_OPTIMIZER_GLB_FILE_H
#define SELVEDGE_OPTIMIZER_GLB_FILE_H

#include "base/status.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct glb_file {
    json_t *views, *accessors, *images, *textures; /* arrays of the document */
    uint8_t *block;
    size_t n_byte;
    bool whole; /* false: memory was lacking; the next call that can fail says so */
};

void glb_init(struct glb_file *g);
void glb_release(struct glb_file *g);

/* Adds n vectors of n_component floats for vertices and returns the index of their accessor, which states their
 * bounds. */
json_int_t glb_add_vectors(struct glb_file *g, const float *value, size_t n, size_t n_component);
/* Adds the corners of triangles, for vertices of fewer than 65,535. */
json_int_t glb_add_corners(struct glb_file *g, const uint16_t *corner, size_t n);
/* Adds a PNG image of bytes, rows from the top, 3 or 4 channels, with a texture that repeats it. Returns the texture's
 * index. */
json_int_t glb_add_texture(struct glb_file *g, const char *name, const uint8_t *pixel, const size_t size[2],
                           size_t n_channel);

/* The bytes of the file, which the caller frees. document: asset, scenes, nodes, meshes, materials and extensions; the
 * reference is taken, and the arrays of g are moved into it. STATUS_NO_MEMORY. */
status glb_bytes(struct glb_file *g, json_t *document, uint8_t **bytes, size_t *n_byte, struct error *err);

#endif
