/* phase_isotropic.v1: f = alpha / (4 pi), extinction the same in all directions. The yardstick of closed forms and
 * furnace tests, and the plainest model to fit. */
#include "renderer/scattering/models/isotropic/isotropic_rows.def"
#include "renderer/scattering/phase_model.h"

#include <math.h>
#include <stdlib.h>

struct phase_state {
    float alpha[3];
    struct phase_extinction extinction;
};

static status prepare(const double *param, struct phase_state **state, struct error *err)
{
    status st = param_check(phase_isotropic.param, phase_isotropic.n_param, phase_isotropic.id, param, err);
    if (st != STATUS_OK) return st;
    struct phase_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare phase function: out of memory");
    for (int c = 0; c < 3; c++) s->alpha[c] = (float)param[c];
    for (int i = 0; i <= PHASE_N_EXTINCTION; i++) s->extinction.value[i] = 1;
    s->extinction.largest = 1;
    s->extinction.i_param = -1;
    *state = s;
    return STATUS_OK;
}

static void release(struct phase_state *s) { free(s); }

static const struct phase_extinction *extinction(const struct phase_state *s) { return &s->extinction; }

static void sample(const struct phase_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    (void)s;
    (void)wo;
    (void)weight_rgb;
    float z = 2 * u[0] - 1, c = sqrtf((1 - z) * (1 + z)), phi = (float)(2 * M_PI) * u[1];
    wi[0] = z;
    wi[1] = c * cosf(phi);
    wi[2] = c * sinf(phi);
}

static float eval_pdf(const struct phase_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float f_rgb[3], float *score)
{
    (void)wi;
    (void)wo;
    (void)weight_rgb;
    for (int c = 0; c < 3; c++) {
        f_rgb[c] = s->alpha[c] * (float)(0.25 * M_1_PI);
        for (int p = 0; p < 3 && score != NULL; p++) score[3 * c + p] = c == p ? 1 / s->alpha[c] : 0;
    }
    return (float)(0.25 * M_1_PI);
}

const struct phase_model phase_isotropic = {
    VOLUME_MODEL_ROW(isotropic), .prepare = prepare, .release = release,
    .extinction = extinction,    .sample = sample,   .eval_pdf = eval_pdf,
};
