/* A triangle mesh with texture coordinates: the surface that a cloth is laid on.
 *
 * Positions in millimetres. Texture coordinates are millimetres of cloth: u along its x axis (the weft), v along its y
 * axis. As in OBJ, corners of triangles name a position and a texture coordinate each, so that texture may have seams.
 * Triangles turn counter-clockwise seen from the upper side of the cloth.
 */
#ifndef SELVEDGE_RENDERER_MESH_H
#define SELVEDGE_RENDERER_MESH_H

#include "base/files/file_ledger.h"
#include "base/status.h"

#include <stddef.h>
#include <stdint.h>

struct mesh_triangle {
    uint32_t position[3], texture[3];
};

struct mesh {
    size_t n_position, n_texture, n_triangle;
    double (*position_mm)[3];
    double (*texture_mm)[2];
    struct mesh_triangle *triangle;
};

enum { MESH_MAX_TRIANGLE = 500000 };

void mesh_release(struct mesh *m);

/* Room for so many positions, texture coordinates and triangles, all zero. STATUS_NO_MEMORY. */
status mesh_new(struct mesh *m, size_t n_position, size_t n_texture, size_t n_triangle, struct error *err);

/* STATUS_INVALID, naming the triangle (from 1, as in the file): an index or number that does not exist or is not
 * finite, a triangle without area on the surface or in the texture, one that is mirrored in the texture, an edge of
 * more than two triangles or of two that turn differently, and a mesh without triangles. */
status mesh_check(const struct mesh *m, struct error *err);

/* Unit normals of the positions: means over the triangles around each, weighted by their angles (Thuermer and Wuethrich
 * 1998). normal: n_position. */
status mesh_normals(const struct mesh *m, double (*normal)[3], struct error *err);

/* Area of the surface over the area of its texture, and root mean squares over the surface of the lengths that a
 * millimetre of cloth along u and along v has on it. All are 1 where cloth lies without stretching. m: checked. */
struct mesh_stretch {
    double area, along[2];
};
struct mesh_stretch mesh_stretch(const struct mesh *m);

/* Reads a Wavefront OBJ file: v, vt and f, with comments, continued lines and a byte order mark; polygons become fans
 * of triangles. ledger: receives the other statements (base/files/file_ledger.h), or NULL. Equal positions become one.
 * Positions and texture coordinates are multiplied by scale_mm. The mesh is checked. STATUS_FORMAT (naming file and
 * line), also for a face without texture coordinates and for curved surfaces; STATUS_TOO_LARGE; STATUS_INVALID as
 * mesh_check; STATUS_IO, STATUS_NOT_FOUND. */
status mesh_read_obj_ledger(const char *path, double scale_mm, struct mesh *m, struct file_ledger *ledger,
                            struct error *err);
/* The same without a ledger. */
status mesh_read_obj(const char *path, double scale_mm, struct mesh *m, struct error *err);

/* Writes such a file, in millimetres with six significant digits, pairs of triangles with a common first corner as one
 * polygon where they lie one after the other. *text belongs to the caller. STATUS_NO_MEMORY. */
status mesh_obj_text(const struct mesh *m, char **text, size_t *n_bytes, struct error *err);

#endif
