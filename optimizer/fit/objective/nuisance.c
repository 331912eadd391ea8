#include "optimizer/fit/objective/nuisance.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <string.h>

void nuisance_show(const struct fit_nuisance *n, const struct estimate *e, struct estimate *out)
{
    double gain = 1.0, stray = 0.0;
    for (size_t i = 0; i < n->n; i++) {
        if (strcmp(n->name[i], NUISANCE_GAIN) == 0) gain = n->value[i];
        if (strcmp(n->name[i], NUISANCE_STRAY_LIGHT) == 0) stray = n->value[i];
    }
    if (out != e) *out = *e;
    for (int c = 0; c < 3; c++) {
        out->mean[c] = gain * e->mean[c] + stray;
        out->var[c] = gain * gain * e->var[c];
    }
}

static void likely_gain(const struct observation *o, const double rendered[3], const double rendered_var[3], double sd,
                        double misfit_var, double *gain, double *se)
{
    double top = 0.0, bottom = 1.0 / (sd * sd), w = objective_relative_weight(o);
    for (int c = 0; c < 3; c++) {
        double var = misfit_var / w + o->se_rgb[c] * o->se_rgb[c] + rendered_var[c];
        if (!(var > 0.0)) continue;
        top += rendered[c] * (o->mean_rgb[c] - rendered[c]) / var;
        bottom += rendered[c] * rendered[c] / var;
    }
    *gain = 1.0 + top / bottom;
    *se = sqrt(1.0 / bottom);
}

void nuisance_photograph_gain(const struct observation *o, const struct estimate *a, const struct estimate *b,
                              double sd, double misfit_var, double *gain, double *se)
{
    double rendered[3], var[3];
    for (int c = 0; c < 3; c++) {
        rendered[c] = 0.5 * (a->mean[c] + b->mean[c]);
        var[c] = 0.25 * (a->var[c] + b->var[c]);
    }
    likely_gain(o, rendered, var, sd, misfit_var, gain, se);
}

void nuisance_apply_own_gain(const struct observation *o, const struct estimate *e, double sd, double misfit_var,
                             struct estimate *out)
{
    double gain, se;
    likely_gain(o, e->mean, e->var, sd, misfit_var, &gain, &se);
    if (out != e) *out = *e;
    for (int c = 0; c < 3; c++) {
        out->mean[c] = gain * e->mean[c];
        out->var[c] = gain * gain * e->var[c];
    }
}
