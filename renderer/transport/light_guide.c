#include "renderer/transport/light_guide.h"

/* From samples of the model at the points of a rank-1 lattice. */
void light_guide_energy_of(const struct scattering_model *m, const struct scattering_state *s,
                           struct light_guide_energy *e)
{
    enum { N = 256 };
    const float near = 0.819f; /* cosine of 35 degrees */
    *e = (struct light_guide_energy){{0}, {0}};
    for (int i = 0; i < N; i++) {
        float u[3] = {((float)i + 0.5f) / N, (float)(i * 75 % N) / N, (float)(i * 181 % N) / N}, wi[3], rgb[3];
        const float view = (float)scattering_view_azimuth_rad(m, i * 113 % N, N),
                    wo[3] = {0, m->near_field ? cosf(view) : 1, m->near_field ? sinf(view) : 0};
        m->sample(s, wo, NULL, u, wi);
        float pdf = m->eval_pdf(s, wi, wo, NULL, rgb, NULL);
        for (int c = 0; c < 3 && pdf > 0; c++) {
            float energy = rgb[c] * fiber_frame_cos_theta(wi) / pdf / N;
            e->all[c] += energy;
            if (-fiber_frame_dot(wi, wo) > near) e->forward[c] += energy;
        }
    }
}
