/* One light path from the camera, with the derivatives of its contribution by every scattering parameter (fabric thesis
 * 5.5.1, figure 5.3): beside the throughput T runs the sum H of the scores d ln S / d p, and every connection to a
 * light adds L to the radiance and L (H + score) to the derivatives. Densities of sampling, roulette, and the weights
 * that combine light samples with scattering samples (power heuristic) and guided shadow paths with the path itself
 * (balance heuristic) are held fixed in the derivatives.
 */
#ifndef SELVEDGE_RENDERER_PATH_TRACER_H
#define SELVEDGE_RENDERER_PATH_TRACER_H

#include "renderer/transport/surface/path_setting.h"

/* ray: from camera_ray; it is changed. record: NULL, or a record with n_step = 0, which receives the path. */
void path_trace(const struct path_setting *s, struct scene_ray *ray, struct rng *rng, struct path_result *out,
                struct path_record *record);

/* The same path under each of n_lamp lamps, which replace the lamp of the setting. Result k equals path_trace
 * with lamp k alone; environments count in all. Further lamps cost their connections only, and the errors of the
 * results are correlated. */
void path_trace_lamps(const struct path_setting *s, const struct lamp *lamp, size_t n_lamp, struct scene_ray *ray,
                      struct rng *rng, struct path_result *out);

/* Sum over channels of the radiance that a recorded path has with other parameters, by the formula at path_step.
 * shows_width: path_setting.shows_width of the path; if true, S contains the fiber's widths as a factor. */
double path_replay(const struct parameter_sets *sets, const struct path_record *record, bool shows_width);

#endif
