/* Camera paths for tables of appearance: from a place of the flat cloth's upper side towards any direction, each
 * connected to parallel lights from up to TABLE_LIGHTS directions. For the files of this folder. */
#ifndef SELVEDGE_RENDERER_TABLE_WALKS_H
#define SELVEDGE_RENDERER_TABLE_WALKS_H

#include "renderer/transport/radiance_tracer.h"
#include "renderer/transport/surface/path_tracer.h"

struct appearance_table;

enum { TABLE_LIGHTS = PATH_MAX_LAMP };

struct table_walks {
    const struct scene *scene;
    struct parameter_sets sets;
    struct path_setting setting;
    uint64_t seed;
    double tile_mm[2], thickness_mm;
    size_t n_side;
    const struct progress *progress;
};

/* STATUS_INVALID, STATUS_NO_MEMORY as appearance_table_make. Release in any case. */
status table_walks_init(struct table_walks *w, const struct radiance_input *in, uint64_t seed, struct error *err);
void table_walks_release(struct table_walks *w);

/* Random numbers of walk i of a purpose and a task (below 4096). */
void table_walks_random(const struct table_walks *w, uint32_t purpose, uint32_t task, uint32_t i, struct rng *rng);
/* A place of the tile for walk i of a task: a sequence that fills the tile evenly (Roberts 2018, R2), moved by the
 * random start[2]. */
void table_walks_place(const struct table_walks *w, const double start[2], uint32_t i, double at_mm[2]);
/* Radiance towards wo at the place, under each light alone. */
void table_walks_trace(const struct table_walks *w, const double at_mm[2], const double wo[3], double (*wi)[3],
                       size_t n_light, struct rng *rng, float (*rgb)[3]);

/* Views from which the textures are made, with TABLE_LIGHTS lights each, one path a texel. */
enum { APPEARANCE_BASIS_VIEWS = 64 };
/* Textures W_1 .. W_(n_basis - 1) of t, whose sizes are set; W_0 is written, too. */
status appearance_basis_make(const struct table_walks *w, struct thread_pool *pool, const struct progress *progress,
                             struct appearance_table *t, struct error *err);

#endif
