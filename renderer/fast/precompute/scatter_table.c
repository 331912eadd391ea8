/* Expansion of S cos th_i into harmonics (fabric thesis, section 6.4.3), by samples of the model at the points of a
 * rank-1 lattice. The axis of the harmonics is the fiber instead of published x, so that tables of other azimuths of
 * w_o differ by a turn about z alone. */
#include "renderer/fast/precompute/precompute_parts.h"
#include "renderer/fast/sphere_harmonics.h"
#include "renderer/scene/fiber_frame.h"

enum { N_SAMPLE = 4096 };

static void fill_entry(const struct precompute_job *j, size_t i_set, size_t i_theta, float *out)
{
    const struct scattering_model *m = j->sets.model;
    const struct scattering_state *state = j->sets.state[i_set];
    size_t n = fast_n_harmonic(j->t);
    float theta = (float)M_PI * ((float)i_theta / (FAST_N_THETA - 1) - 0.5f);
    const float wo[3] = {sinf(theta), fmaxf(cosf(theta), 1e-4f), 0};
    double sum[3 * SPHERE_MAX_COUNT] = {0.0};
    for (int i = 0; i < N_SAMPLE; i++) {
        const float u[3] = {((float)i + 0.5f) / N_SAMPLE, (float)(i * 1487 % N_SAMPLE) / N_SAMPLE,
                            (float)(i * 2971 % N_SAMPLE) / N_SAMPLE};
        float wi[3], rgb[3], y[SPHERE_MAX_COUNT];
        m->sample(state, wo, NULL, u, wi);
        float pdf = m->eval_pdf(state, wi, wo, NULL, rgb, NULL);
        if (!(pdf > 0)) continue;
        float weight = fiber_frame_cos_theta(wi) / pdf / N_SAMPLE;
        const float d[3] = {wi[1], wi[2], wi[0]};
        sphere_harmonics(j->t->order, d, y);
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < n; k++) sum[c * n + k] += (double)(rgb[c] * weight * y[k]);
    }
    for (size_t k = 0; k < 3 * n; k++) out[k] = (float)sum[k];
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct precompute_job *j = context;
    fill_entry(j, i_task / FAST_N_THETA, i_task % FAST_N_THETA, j->t->scatter + i_task * 3 * fast_n_harmonic(j->t));
}

status precompute_scatter(struct precompute_job *j, struct error *err)
{
    status s = fast_tables_reserve_scatter(j->t, err);
    if (s == STATUS_OK) s = thread_pool_run(j->pool, (size_t)j->t->n_set * FAST_N_THETA, run_task, j, j->progress);
    return s;
}
