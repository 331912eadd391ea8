/* The appearance of a flat, endless cloth as tables, for programs that cannot trace its fibers: a page in a browser.
 *
 *     L(x, wo, wi) = |cos th_i| / (|cos th_i| + |cos th_o|) sum_k W_k(x) T_k(wo, wi)
 *
 * is the radiance towards wo at the place x of the upper side (z = 0) under parallel light from wi with irradiance pi
 * on a surface that faces it, as the path tracer has it: all scattering, shadows and the parallax of the fibers below x
 * are in it. This is a bidirectional texture function (Dana et al. 1999), factored as by Koudelka et al. 2003 into
 * textures W_k and their weights T_k. W_0 is 1, so T_0 is the mean of the tile; the other W_k have mean 0 and mean
 * square 1, and are at a right angle with each other. The first factor describes a deep layer of single scatterers
 * (Seeliger 1888): the remainder changes slowly even where light and view graze the cloth. Textures that are averaged
 * over an area (mipmaps) give the mean radiance of it.
 *
 * Directions form a square grid over each hemisphere (direction_grid.h): view (side, row, column), light
 * likewise, side 0 above. Between the middles of the grid's cells the table is interpolated bilinearly.
 */
#ifndef SELVEDGE_RENDERER_APPEARANCE_TABLE_H
#define SELVEDGE_RENDERER_APPEARANCE_TABLE_H

#include "base/thread_pool.h"
#include "renderer/transport/radiance_tracer.h"

enum { APPEARANCE_MAX_BASIS = 32 };
#define APPEARANCE_UPRIGHT 0.342 /* cosine of 70 degrees */

struct appearance_table_option {
    size_t texels;     /* about so many places of the tile */
    size_t view_edge;  /* cells along an edge of the grid of views */
    size_t light_edge; /* the same of lights */
    size_t n_basis;    /* textures, with W_0: a multiple of 4 */
    uint64_t n_path;   /* camera paths of the means, each connected to 16 lights */
    uint64_t seed;
};

struct appearance_table {
    size_t width, height, n_basis, view_edge, light_edge;
    size_t n_side; /* 1: views and lights are above only; 2: on both sides */
    double tile_mm[2];
    float *weight;   /* owned; n_basis x height x width: W_k at the middles of texels, row 0 at y = 0 */
    float *value;    /* owned; n_view x n_light x n_basis x 3: T_k */
    size_t n_smooth; /* steps of smoothing over neighbouring cells, as many as bring the table nearer to the truth */
    /* How far the interpolated T_0 is from means traced anew in random directions, root mean square over their mean,
     * each weighted by cos th_o; and the part of it that is the noise of the means. The first two figures leave out
     * light and view beyond 70 degrees, where a cloth may be many times as bright. */
    double mean_rel_rms, mean_rel_noise, all_rel_rms, all_rel_noise;
};

size_t appearance_table_n_direction(const struct appearance_table *t, size_t edge);

/* Paths with TABLE_LIGHTS lights that the textures, the smoothing and the check of the table's error take, besides
 * n_path. */
double appearance_table_fixed_paths(size_t n_texel);
/* The cloth of in->scene.fibers, which must be flat. Both sides are computed if it has no black sheet. The bits do not
 * depend on the number of threads. STATUS_INVALID: a volume model, a bent cloth, sizes of 0 or too large, and as
 * radiance_source_init; STATUS_NO_MEMORY, STATUS_CANCELLED. */
status appearance_table_make(const struct radiance_input *in, const struct appearance_table_option *o,
                             struct thread_pool *pool, const struct progress *progress, struct appearance_table *t,
                             struct error *err);
void appearance_table_release(struct appearance_table *t);

/* T_0, interpolated, with its factor: the mean radiance of the tile. wo, wi: unit vectors. */
void appearance_table_mean(const struct appearance_table *t, const double wo[3], const double wi[3], double rgb[3]);

#endif
