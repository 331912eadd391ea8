#include "renderer/transport/surface/fiber_walk.h"
#include "renderer/scene/fiber_frame.h"
#include "renderer/transport/path_value.h"
#include "renderer/transport/surface/path_film.h"

bool fiber_walk_enter(const struct scene *scene, bool from_below, struct rng *rng, struct scene_ray *ray)
{
    double tile_mm[2];
    scene_tile_mm(scene, tile_mm);
    double u = rng_double(rng), r = sqrt(u), phi = 2.0 * M_PI * rng_double(rng);
    double z = sqrt(1.0 - u) + 1e-6, side = from_below ? -1.0 : 1.0;
    const double d[3] = {r * cos(phi), r * sin(phi), -side * z};
    double start[3] = {tile_mm[0] * rng_double(rng), tile_mm[1] * rng_double(rng),
                       from_below ? -scene_thickness_mm(scene) - 0.01 : 0.01};
    return scene_ray_enter(scene, start, d, ray);
}

/* The fiber frame of a hit on a film. */
static void film_frame(const struct scene *scene, const struct scene_hit *hit, struct fiber_frame *frame)
{
    float normal[3];
    if (scene_section_normal(scene, hit, normal))
        fiber_frame_flat_in(frame, hit->tangent, normal);
    else
        fiber_frame_from(frame, hit->tangent);
}

bool fiber_walk_step(const struct scene *scene, const struct parameter_sets *sets, const struct scene_hit *hit,
                     struct scene_ray *ray, struct rng *rng, float throughput[3])
{
    const struct scattering_model *m = sets->model;
    const struct film_material *film = scene_film(scene, hit->i_segment);
    const float back[3] = {-ray->direction[0], -ray->direction[1], -ray->direction[2]};
    const double offset_mm[2] = {ray->offset_mm[0], ray->offset_mm[1]};
    struct fiber_frame frame;
    float wo[3], wi[3], u[3], rgb[3], direction[3], next[3], survival = 1;
    float pdf;
    for (int a = 0; a < 3; a++) u[a] = rng_float(rng);
    if (film != NULL) {
        film_frame(scene, hit, &frame);
        fiber_frame_to_local(&frame, back, wo);
        film_facets_sample(film, wo, u, wi);
        pdf = path_film_eval(film, wi, wo, rgb);
    } else {
        const struct scattering_state *state = sets->state[sets->n > 1 ? scene_group_of(scene, hit->i_segment) : 0];
        fiber_frame_from(&frame, hit->tangent);
        fiber_frame_to_local(&frame, back, wo);
        m->sample(state, wo, throughput, u, wi);
        pdf = m->eval_pdf(state, wi, wo, throughput, rgb, NULL);
    }
    if (!(pdf > 0)) return false;
    for (int c = 0; c < 3; c++) next[c] = throughput[c] * rgb[c] * fiber_frame_cos_theta(wi) / pdf;
    float most = path_value_largest(next);
    if (!(most > 0)) return false;
    if (most < PATH_SURFACE_ROULETTE_BELOW && !path_value_survives(most, PATH_SURFACE_ROULETTE_BELOW, rng, &survival))
        return false;
    for (int c = 0; c < 3; c++) throughput[c] = next[c] / survival;
    fiber_frame_to_world(&frame, wi, direction);
    fiber_walk_leave(m, hit, offset_mm, direction, rng, ray);
    return true;
}
