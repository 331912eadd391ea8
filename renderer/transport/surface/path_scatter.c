#include "renderer/transport/surface/path_scatter.h"

float path_scatter_widths(const struct scattering_model *m, const struct scattering_state *state, const float wi[3],
                          const float wo[3], float *score)
{
    float by_in[SCATTERING_MAX_PARAM], by_out[SCATTERING_MAX_PARAM];
    const float in = m->width(state, wi, score != NULL ? by_in : NULL),
                out = m->width(state, wo, score != NULL ? by_out : NULL);
    for (size_t c = 0; c < 3 && score != NULL; c++)
        for (size_t p = 0; p < m->n_param; p++) score[c * m->n_param + p] += by_in[p] - by_out[p];
    return in / out;
}
