/* dielectric_near.v1: the near field of dielectric.v1, with the same parameters (near_field.h). */
#include "renderer/scattering/models/dielectric/near_field.h"

#include <stdlib.h>

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st = param_check(surface_dielectric_near_param, NEAR_N_PARAM, surface_dielectric_near_id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    for (int p = 0; p < DIELECTRIC_N_LOBE; p++) {
        s->d_width[p] = sqrt(p + 1.0);
        near_azimuth_init(&s->azimuth[p], NEAR_GAUSSIAN, s->d_width[p] * param[NEAR_P_AROUND]);
    }
    s->eta = param[NEAR_P_ETA];
    s->d_beta = 1;
    for (int c = 0; c < 3; c++) {
        s->c_t[c] = param[NEAR_P_COLOR + c];
        s->d_c_t[c] = 1;
    }
    return near_field_finish(s, param[NEAR_P_ALONG], state, err);
}

const struct scattering_model scattering_dielectric_near = {
    SURFACE_MODEL_ROW(dielectric_near),
    .prepare = prepare,
    NEAR_FIELD_FUNCTIONS,
};
