/* One cloth with one model of appearance at given parameter values, ready to be traced: what estimates, pictures and
 * the derivative check are made from. Three implementations stand behind one table of functions: fibers with a
 * scattering model (surface/surface_radiance.c), the same by tables (renderer/fast/fast_radiance.c), and a density
 * volume with a phase function (volume/volume_radiance.c). Two more serve previews: dual scattering of fibers
 * (renderer/quick/dual_radiance.c), and diffusion in a pile (renderer/quick/diffusion_radiance.c).
 *
 * Derivatives are numbered flat: the parameters of set 0, then of set 1, ...; derivatives of channel c start at c *
 * n_flat. A source is immutable after radiance_source_init: threads share it. It copies nothing of its input.
 */
#ifndef SELVEDGE_RENDERER_RADIANCE_SOURCE_H
#define SELVEDGE_RENDERER_RADIANCE_SOURCE_H

#include "renderer/transport/radiance_tracer.h"

enum { RADIANCE_NAME_BYTES = 56 };

struct radiance_source {
    const struct radiance_tracer *tracer;
    void *state;
    const struct appearance *model;
    size_t n_set;  /* at least 1 */
    size_t n_flat; /* derivatives per channel: n_set * model->n_param, 0 when none are wanted */
};

/* STATUS_INVALID, field "model", when the cloth lacks the form that the model needs; field "n_set" for a number of sets
 * that cloth or model do not allow, otherwise the name of a parameter. STATUS_NO_MEMORY. n_configuration may be 0 for a
 * source that only replays. */
status radiance_source_init(struct radiance_source *source, const struct radiance_input *in,
                            const struct configuration *c, size_t n_configuration, struct error *err);
/* Accepts a source that is all zero or whose init failed. */
void radiance_source_release(struct radiance_source *source);
/* "beta_TT", or "set1.beta_TT" when there are several sets. */
void radiance_derivative_name(const struct radiance_source *source, size_t i_flat, char text[RADIANCE_NAME_BYTES]);

#endif
