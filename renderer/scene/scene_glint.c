#include "renderer/scene/scene_glint.h"

#include "base/rng.h"
#include "renderer/scene/bent_scene.h"
#include "renderer/scene/scene_glint_data.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* Texels in a grain. */
#define TEXELS_PER_GRAIN 8.0f
/* Standard deviation of normals that no texel resolves. */
#define UNRESOLVED 0.01f
/* Brushed films have waves that are longer along the film by this factor. */
#define BRUSHED_RATIO 12.0f

struct scene_glints {
    pthread_mutex_t lock;
    struct glint_surface *surface[FILM_MAX_GROUP];
    struct wave_glint *waves[FILM_MAX_GROUP];
};

bool scene_has_glints(const struct film_groups *films)
{
    for (size_t k = 0; k < films->n; k++)
        if (films->material[k].surface != FILM_SMOOTH) return true;
    return false;
}

struct scene_glints *scene_glints_new(void)
{
    struct scene_glints *g = calloc(1, sizeof *g);
    if (g != NULL) pthread_mutex_init(&g->lock, NULL);
    return g;
}

void scene_glints_free(struct scene_glints *g)
{
    if (g == NULL) return;
    for (int k = 0; k < FILM_MAX_GROUP; k++) {
        glint_surface_free(g->surface[k]);
        wave_glint_free(g->waves[k]);
    }
    pthread_mutex_destroy(&g->lock);
    free(g);
}

static status make(const struct film_material *m, uint64_t seed, struct glint_surface **out, struct error *err)
{
    static const enum glint_kind kind[] = {[FILM_NOISE] = GLINT_NOISE,
                                           [FILM_BRUSHED] = GLINT_NOISE,
                                           [FILM_SCRATCHES] = GLINT_SCRATCHES,
                                           [FILM_FLAKES] = GLINT_FLAKES};
    struct glint_option o = {.kind = kind[m->surface],
                             .seed = seed,
                             .texel_um = m->grain_um / TEXELS_PER_GRAIN,
                             .slope = fminf(m->roughness, (float)FILM_MOST_SLOPE),
                             .roughness = UNRESOLVED,
                             .length_um = {m->grain_um, m->grain_um},
                             .flake_um = m->grain_um};
    if (m->surface == FILM_BRUSHED) o.length_um[0] *= BRUSHED_RATIO;
    return glint_surface_new(&o, out, err);
}

/* Scratches cover 0.3 of the tile. */
static status make_waves(const struct film_material *m, uint64_t seed, struct wave_glint **out, struct error *err)
{
    struct wave_glint_option o = wave_glint_option_usual();
    struct film_waves w;
    film_waves_of(m, &w);
    o.model = (enum wave_model)(m->optics - FILM_OHS);
    o.height.seed = seed;
    memcpy(o.height.length_um, w.length_um, sizeof w.length_um);
    o.height.rms_um = w.rms_um;
    o.height.scratch_width_um = w.scratch_width_um;
    o.height.scratch_depth_um = w.scratch_depth_um;
    if (w.scratch_width_um > 0)
        o.height.n_scratch = (size_t)(0.3 * (double)o.height.n * o.height.texel_um / (0.2 * 4 * w.scratch_width_um));
    return wave_glint_new(&o, out, err);
}

status scene_glints_make(const struct scene *s, struct error *err)
{
    status st = STATUS_OK;
    if (s->glints == NULL) return st;
    pthread_mutex_lock(&s->glints->lock);
    for (size_t k = 0; k < s->films.n && st == STATUS_OK; k++) {
        const struct film_material *m = &s->films.material[k];
        if (m->surface != FILM_SMOOTH && s->glints->surface[k] == NULL)
            st = make(m, k + 1, &s->glints->surface[k], err);
        if (st == STATUS_OK && film_has_waves(m) && s->glints->waves[k] == NULL)
            st = make_waves(m, k + 1, &s->glints->waves[k], err);
    }
    pthread_mutex_unlock(&s->glints->lock);
    return st;
}

const struct wave_glint *scene_glint_waves(const struct scene *s, const struct scene_hit *hit)
{
    const struct film_material *m = s->glints != NULL ? scene_film(s, hit->i_segment) : NULL;
    return m != NULL ? s->glints->waves[m - s->films.material] : NULL;
}

/* The place of a hit in the flat cloth, tiles of its copy not taken off. */
static void in_cloth(const struct scene *s, const struct scene_hit *hit, const double offset_mm[2], double p[3])
{
    double world[3];
    for (int a = 0; a < 3; a++) world[a] = (double)hit->position_mm[a] + (a < 2 ? offset_mm[a] : 0.0);
    if (s->bent == NULL) {
        memcpy(p, world, sizeof world);
        return;
    }
    const struct shell_cell *c = &s->bent->space.shell.cell[hit->i_cell];
    for (int a = 0; a < 3; a++) {
        p[a] = c->to_cloth[a][3];
        for (int k = 0; k < 3; k++) p[a] += c->to_cloth[a][k] * world[k];
    }
}

/* Where on the map a film begins. */
static void begin_of(const struct scene *s, uint32_t i_segment, const int32_t copy[2], double period_um,
                     float begin_um[2])
{
    const struct rng_key key = {.seed = 1 + s->segment_fiber[i_segment]};
    struct rng rng;
    rng_start(&rng, &key, (uint32_t)copy[0], (uint32_t)copy[1]);
    for (int a = 0; a < 2; a++) begin_um[a] = (float)(period_um * rng_double(&rng));
}

const struct glint_surface *scene_glint_at(const struct scene *s, const struct scene_hit *hit,
                                           const double offset_mm[2], float place_um[2])
{
    const struct film_material *m = s->glints != NULL ? scene_film(s, hit->i_segment) : NULL;
    const struct glint_surface *surface = m != NULL ? s->glints->surface[m - s->films.material] : NULL;
    if (surface == NULL) return NULL;
    const size_t v = s->segment_vertex[hit->i_segment];
    const struct scene_vertex *x = &s->vertex[v];
    const float t[3] = {x[1].x - x->x, x[1].y - x->y, x[1].z - x->z},
                length = sqrtf(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]), *axis = s->long_axis[v];
    const double at[3] = {(double)x->x, (double)x->y, (double)x->z};
    double p[3], along = 0, across = 0;
    int32_t copy[2];
    in_cloth(s, hit, offset_mm, p);
    for (int a = 0; a < 2; a++) {
        const double tiles = round((p[a] - at[a]) / s->tile_mm[a]);
        copy[a] = (int32_t)tiles;
        p[a] -= tiles * s->tile_mm[a];
    }
    for (int a = 0; a < 3; a++) {
        along += (p[a] - at[a]) * (double)t[a] / (double)length;
        across += (p[a] - at[a]) * (double)axis[a];
    }
    begin_of(s, hit->i_segment, copy, (double)glint_period_um(surface), place_um);
    place_um[0] += (float)(1e3 * ((double)s->arc_mm[v] + along));
    place_um[1] += (float)(1e3 * across);
    return surface;
}
