/* Fibers as polylines: the result of the reconstruction and the input of the renderer.
 *
 * Frame: the cloth frame of volume.h, in metres. The cloth repeats with period tile_size_m in x and y; vertices may
 * lie slightly outside [0, tile_size_m). Fiber i has vertices first_vertex[i] .. first_vertex[i+1]-1, at least two.
 * The caller initialises and releases the struct, which owns its arrays. */
#ifndef SELVEDGE_GEOMETRY_FIBER_SET_H
#define SELVEDGE_GEOMETRY_FIBER_SET_H

#include "base/status.h"
#include "geometry/fibers/fiber_shape.h"

#include <stdint.h>

/* Fibers belong to groups, such as the kinds of yarn of a cloth. Each group may have scattering parameters of its own.
 * Scans and most files have group 0 only. */
enum { FIBER_MAX_GROUP = 8 };
/* Largest number of segments of a strand in a .hair file. */
enum { FIBER_HAIR_MAX_SEGMENT = 65535 };

struct fiber_set {
    size_t n_fiber;
    size_t n_vertex;
    size_t *first_vertex; /* n_fiber + 1 */
    float *position_m;    /* n_vertex x 3, row-major */
    float *radius_m;      /* n_fiber: mean over the vertices where it varies along a fiber */
    uint8_t *axis_class;  /* n_fiber: 0 x (weft), 1 y (warp), 2 z (pile) */
    uint8_t *group;       /* n_fiber: below FIBER_MAX_GROUP */
    /* n_vertex: the sections, metres; NULL: discs of radius_m. Change radii by fiber_set_scale_radius. */
    struct fiber_shape *shape;
    double tile_size_m[2];
};

/* Radius of fiber i at vertex k, which is one of its own. */
static inline float fiber_radius_m(const struct fiber_set *f, size_t i, size_t k)
{
    return f->shape != NULL ? f->shape[k].radius : f->radius_m[i];
}

/* Makes an empty set, which may be released. */
void fiber_set_init(struct fiber_set *f);
void fiber_set_release(struct fiber_set *f);
/* Allocates n_fiber fibers with n_vertex vertices in total and sets the counts. first_vertex,
 * axis_class and group are zero; the other arrays are uninitialised. Earlier content is released, but the tile size is
 * kept. STATUS_NO_MEMORY. */
status fiber_set_reserve(struct fiber_set *f, size_t n_fiber, size_t n_vertex, struct error *err);
/* Gives every vertex a disc of the radius of its fiber, if the set has no sections yet. STATUS_NO_MEMORY. */
status fiber_set_add_shapes(struct fiber_set *f, struct error *err);
/* Multiplies the radius of a fiber, also along it. */
void fiber_set_scale_radius(struct fiber_set *f, size_t i_fiber, double factor);
/* Whether any vertex has a lumen, or was found to have none. */
bool fiber_set_has_lumens(const struct fiber_set *f);
/* Makes `to` (initialised) a copy. STATUS_NO_MEMORY. */
status fiber_set_copy(const struct fiber_set *from, struct fiber_set *to, struct error *err);
/* STATUS_INVALID, naming the fiber, for NaN, fewer than two vertices, radius <= 0, group >= FIBER_MAX_GROUP; also for
 * tile size <= 0, for no fiber, and for a section whose ratio of axes is not between 1 and FIBER_RATIO_MOST. */
status fiber_set_validate(const struct fiber_set *f, struct error *err);
/* The highest group of any fiber, plus 1. */
size_t fiber_set_n_group(const struct fiber_set *f);
/* The total length of all polylines, and the lowest and highest z of the surfaces of the fibers. */
double fiber_set_length_m(const struct fiber_set *f);
void fiber_set_z_range_m(const struct fiber_set *f, double *z_min_m, double *z_max_m);

/* Sets the class of each fiber to the axis along which it extends most (sum of |dx|, |dy|, |dz| over its segments). */
void fiber_set_classify(struct fiber_set *f);

/* Cem Yuksel's .hair (docs/file-formats.md): positions in millimetres, and per point the thickness, which is the
 * diameter in millimetres. The 88-byte text of the header contains "selvedge tile_mm=<x>,<y>", the tile size;
 * without it the tile size is 0 after reading and the caller must set it. If a fiber has another group than 0, the
 * text goes on with " groups=rgb" and the colours of the points are the groups; colours without this text are
 * ignored. If the fibers have sections, the text ends with " sections", and seven numbers for each point follow the
 * format's own arrays; or with " lumens", and nine. Reading sets axis classes from the directions, takes half the
 * mean thickness of a fiber's points as its radius, and applies default segments and thickness of files of other
 * programs; where the thickness varies along a fiber, so does its radius, and points thinner than a twentieth of the
 * mean get that. It checks the header against the length of the file before it allocates. It replaces the content of
 * f, or leaves f unchanged on failure. A fiber of more than 65,536 vertices is written as several strands that share
 * a vertex, and is read back as several fibers. Errors name the file without its folder: STATUS_FORMAT (not a .hair
 * file, counts that contradict each other or the length, no thickness, not finite, a colour that is no group,
 * numbers that are no section), STATUS_TOO_LARGE (more vertices than the header can count, 2^32), STATUS_NOT_FOUND,
 * STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY. */
status fiber_set_write_hair(const struct fiber_set *f, const char *path, struct error *err);
status fiber_set_read_hair(struct fiber_set *f, const char *path, struct error *err);
/* Text: a line "x y z radius" in millimetres for each vertex, and a blank line between fibers. If a fiber has
 * another group than 0, every line is "x y z radius group"; when read, all lines of a fiber must agree. If the
 * fibers have sections, seven numbers follow the group, or nine with lumens, also where it is 0
 * (docs/file-formats.md). The format has no tile size: reading sets it to 0 and the caller must set it. The radius
 * of a fiber is the mean of its lines, and varies along it as they do. STATUS_FORMAT names the line; else as above. */
status fiber_set_write_text(const struct fiber_set *f, const char *path, struct error *err);
status fiber_set_read_text(struct fiber_set *f, const char *path, struct error *err);

#endif
