#include "renderer/glint/wave_diffraction.h"

#include <string.h>

/* A row of figure 2.5. */
static const struct {
    const char *name;
    bool is_reciprocal, has_fixed_phase, has_tilt;
} row[WAVE_N_MODEL] = {
    [WAVE_OHS] = {"ohs", false, true, false},
    [WAVE_GHS] = {"ghs", false, false, false},
    [WAVE_R_OHS] = {"r_ohs", true, true, false},
    [WAVE_R_GHS] = {"r_ghs", true, false, false},
    [WAVE_KIRCHHOFF] = {"kirchhoff", true, false, true},
};

const char *wave_model_name(enum wave_model model) { return row[model].name; }

bool wave_model_find(const char *name, enum wave_model *model)
{
    for (int i = 0; i < WAVE_N_MODEL; i++)
        if (strcmp(row[i].name, name) == 0) {
            *model = (enum wave_model)i;
            return true;
        }
    return false;
}

bool wave_model_is_reciprocal(enum wave_model model) { return row[model].is_reciprocal; }

bool wave_factors_of(enum wave_model model, const float wi[3], const float wo[3], struct wave_factors *f)
{
    if (!(wi[2] > 0 && wo[2] > 0)) return false;
    for (int k = 0; k < 3; k++) f->psi[k] = wi[k] + wo[k];
    f->xi_1 = row[model].is_reciprocal ? f->psi[2] * f->psi[2] / (4 * wi[2] * wo[2]) : wo[2] / wi[2];
    f->xi_3 = row[model].has_fixed_phase ? 2 : f->psi[2];
    f->per_psi_n = row[model].has_tilt ? 1 / f->psi[2] : 0;
    return true;
}
