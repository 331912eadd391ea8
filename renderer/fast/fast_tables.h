/* The tables of the fast renderer for a cloth with one set of scattering parameters (fabric thesis, section 6.4): the
 * transfer of light from cell to cell, the visibility of each segment, and the scattering of a fiber, in spherical
 * harmonics.
 *
 * Frame and millimetres of scene_ray.h. Harmonics: sphere_harmonics.h. Immutable once made: shared by threads.
 *
 * Transfer. The tile is cut into cells. Of a cell, transfer[((c * n_harmonic) + j_1) * n_harmonic + j_0] is the
 * coefficient by which light from outside, Y(j_0) of its direction, becomes radiance that arrives, Y(j_1) of the
 * direction it comes from, after it has met at least one fiber (the IIRTF of section 6.4.2), channel c. It is the mean
 * over the places in the cell that are seen from outside, each as often as it is seen. With a black sheet under the
 * cloth, light from below is treated as light from its mirror image above, which keeps the function smooth at the
 * horizon; nobody may ask for light from below then.
 *
 * Visibility. A segment that sees anything of the open has a row. Row r holds n_component numbers, whose product with
 * the basis gives the signed distance in radians to the nearest direction of the other kind, positive where the open
 * is seen, over a grid in theta (from +z) and phi; and 2 n_gaussian weights, the share of the directions nearest to
 * each axis of the upper, then of the lower half that see the open, as 0 to 255.
 */
#ifndef SELVEDGE_RENDERER_FAST_TABLES_H
#define SELVEDGE_RENDERER_FAST_TABLES_H

#include "base/status.h"
#include "renderer/fast/deep_factor.h"
#include "renderer/fast/deep_light.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    FAST_N_THETA = 512,    /* entries of the scattering table, th_o from -pi/2 to pi/2 */
    FAST_N_COMPONENT = 48, /* principal components of the signed distances */
    FAST_N_GAUSSIAN = 48,  /* spherical Gaussians over half a sphere */
    FAST_N_GRID = 64,      /* of the signed distances, in theta and in phi */
    FAST_N_PICTURE = 128,  /* of the binary picture that they come from */
    FAST_GAUSSIAN_SHARPNESS = 128
};
#define FAST_NO_ROW UINT32_MAX

struct fast_tables {
    uint64_t checksum; /* of cloth and parameters: fast_tables_checksum */
    double tile_mm[2], bottom_mm;
    double mean_free_path_mm; /* between neighbouring vertices of a path from the 5th on */
    double spread_mm;         /* standard deviation, along one axis, of where light leaves from where it entered */
    uint32_t order;           /* of the harmonics */
    uint32_t mirrored;        /* 1: a black sheet lies under the cloth */
    uint32_t n_set;
    uint32_t n_cell[3]; /* along x, y and down from z = 0 */
    uint32_t n_transfer, n_segment, n_row;
    float transfer_error;   /* relative standard error of the transfer to a cell, root mean square */
    uint32_t *cell;         /* n_cell[2] x n_cell[1] x n_cell[0]: row of transfer, or FAST_NO_ROW: nobody sees it */
    float *transfer;        /* n_transfer x 3 x n_harmonic x n_harmonic */
    float *scatter;         /* n_set x FAST_N_THETA x 3 x n_harmonic: of S cos th_i over directions in the frame whose
                               z is the fiber and whose x-z plane holds w_o */
    uint32_t *segment_row;  /* n_segment: row of its visibility, or FAST_NO_ROW */
    float *basis;           /* FAST_N_GRID^2 x (1 + FAST_N_COMPONENT): mean distance, then the components */
    float *component_scale; /* FAST_N_COMPONENT: value of one step */
    int8_t *component;      /* n_row x FAST_N_COMPONENT */
    uint8_t *gaussian;      /* n_row x 2 FAST_N_GAUSSIAN */
    struct deep_light deep;
};

static inline uint32_t fast_n_harmonic(const struct fast_tables *t) { return (t->order + 1) * (t->order + 1); }
static inline size_t fast_n_cell(const struct fast_tables *t)
{
    return (size_t)t->n_cell[0] * t->n_cell[1] * t->n_cell[2];
}

/* Allocates arrays of the stated counts, all zero. STATUS_NO_MEMORY. Each part separately, as counts become known: */
status fast_tables_reserve_cells(struct fast_tables *t, struct error *err);    /* n_cell */
status fast_tables_reserve_transfer(struct fast_tables *t, struct error *err); /* n_transfer, order */
status fast_tables_reserve_scatter(struct fast_tables *t, struct error *err);  /* n_set, order */
status fast_tables_reserve_segments(struct fast_tables *t, struct error *err); /* n_segment */
status fast_tables_reserve_rows(struct fast_tables *t, struct error *err);     /* n_row */
status fast_tables_reserve_deep(struct fast_tables *t, struct error *err);     /* sizes of deep */
void fast_tables_release(struct fast_tables *t);

/* The row of transfer at a place within the tile, FAST_NO_ROW where there is none. */
uint32_t fast_tables_cell_at(const struct fast_tables *t, const float position_mm[3]);
/* The signed distance that the tables have of a segment's row in a unit direction, linear between the grid's points. */
float fast_tables_distance(const struct fast_tables *t, uint32_t row, const float direction[3]);
/* The axis q of the spherical Gaussians of a segment: 0 .. n - 1 above, n .. 2 n - 1 below. Fibonacci points turned
 * about z by i_segment golden sections of a turn, rounded down to whole columns of the picture. */
void fast_tables_axis(uint32_t i_segment, size_t q, float axis[3]);

/* Writes one file, replacing it (NOTES.md of this folder). STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY. */
status fast_tables_write(const struct fast_tables *t, const char *path, struct error *err);
/* STATUS_FORMAT: not such a file, another version, or counts that make no sense; STATUS_CHECKSUM: damaged;
 * STATUS_NOT_FOUND, STATUS_IO, STATUS_NO_MEMORY. t: nothing to release on failure. */
status fast_tables_read(struct fast_tables *t, const char *path, struct error *err);

enum fast_visibility {
    FAST_TRACED = 0, /* light that is scattered once is traced: a shadow ray through the fibers */
    FAST_TABLES      /* it is seen or not as the tables say, and shaded by the shell of a bent cloth */
};

/* How a radiance source uses the tables. */
struct fast_option {
    const struct fast_tables *tables;
    enum fast_visibility visibility;
    /* Hits that are traced, with FAST_TRACED; at the last of them the table has the light that was scattered before. 1
     * is the published method; more take longer, and have sharper light in the cloth. 0: 1. */
    uint32_t n_traced;
    /* Take light that is scattered more than n_traced times from tables->deep, at the first hit of a path, instead of
     * from the cells at the last. With FAST_TRACED and n_traced as in the table. */
    bool deep;
    const struct deep_factor *factor; /* on deep light; NULL: 1 */
};

#endif
