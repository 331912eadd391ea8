/* Fibers as polylines: what geometry gives and the renderer takes.
 *
 * Frame: the cloth frame of volume.h, metres. The cloth repeats with period tile_size_m in x and y; vertices may lie a little
 * outside [0, tile_size_m). Fiber i has vertices first_vertex[i] .. first_vertex[i+1]-1, at least two.
 * Ownership: init/release; arrays are malloc'ed and owned.
 */
#ifndef SELVEDGE_GEOMETRY_FIBER_SET_H
#define SELVEDGE_GEOMETRY_FIBER_SET_H

#include "base/status.h"

#include <stdint.h>

struct fiber_set {
    size_t n_fiber;
    size_t n_vertex;
    size_t *first_vertex; /* n_fiber + 1 */
    float *position_m;    /* n_vertex x 3, row-major */
    float *radius_m;      /* n_fiber */
    uint8_t *axis_class;  /* n_fiber: 0 x (weft), 1 y (warp), 2 z (pile) */
    double tile_size_m[2];
};

/* An empty set that release accepts. */
void fiber_set_init(struct fiber_set *f);
void fiber_set_release(struct fiber_set *f);
/* Room for n_fiber fibers with n_vertex vertices in all: sets the counts; first_vertex is zero, the other arrays are uninitialised.
 * Earlier content is released, the tile size stays. STATUS_NO_MEMORY. */
status fiber_set_reserve(struct fiber_set *f, size_t n_fiber, size_t n_vertex, struct error *err);
/* STATUS_INVALID, naming the fiber, for: NaN, fewer than two vertices, radius <= 0, tile size <= 0, no fiber. */
status fiber_set_validate(const struct fiber_set *f, struct error *err);
/* Total length of all polylines in metres; lowest and highest z of the fiber surfaces. */
double fiber_set_length_m(const struct fiber_set *f);
void fiber_set_z_range_m(const struct fiber_set *f, double *z_min_m, double *z_max_m);

/* Set every axis class to the axis along which the fiber runs farthest (sum of |dx|, |dy|, |dz| over its segments). */
void fiber_set_classify(struct fiber_set *f);

/* Cem Yuksel's .hair (docs/file-formats.md): positions in millimetres, thickness = DIAMETER in millimetres, per point.
 * The 88-byte text of the header carries "selvedge tile_mm=<x>,<y>" so that a set read back tiles as before; axis classes are
 * found again from the directions. Reading checks the header against the file's length before it allocates.
 * A fiber's radius is half the mean thickness of its points; default segments and thickness of other programs' files are honoured.
 * Without that text the tile size is 0 and the caller must set it. Reading replaces f's content, or leaves it as it was.
 * A fiber of more than 65,536 vertices is written as several strands that share a vertex, and is several fibers when read back.
 * Errors name the file without its folder. STATUS_FORMAT (not a .hair file, counts that contradict each other or the length, no thickness, not finite),
 * STATUS_TOO_LARGE for more vertices to write than the header can count (2^32); STATUS_NOT_FOUND, STATUS_IO, STATUS_DISK_FULL,
 * STATUS_NO_MEMORY. */
status fiber_set_write_hair(const struct fiber_set *f, const char *path, struct error *err);
status fiber_set_read_hair(struct fiber_set *f, const char *path, struct error *err);
/* Text: "x y z radius" per line, millimetres, blank line between fibers. The format has no place for the tile size: reading sets it
 * to 0 and the caller must set it; a fiber's radius is the mean of its lines'. STATUS_FORMAT names the line; else as above. */
status fiber_set_write_text(const struct fiber_set *f, const char *path, struct error *err);
status fiber_set_read_text(struct fiber_set *f, const char *path, struct error *err);

#endif
