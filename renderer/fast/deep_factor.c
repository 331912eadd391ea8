#include "renderer/fast/deep_factor.h"
#include "renderer/fast/deep_light.h"

#include <math.h>

static const float middle_depth = 0.3f, least = 0.2f, most = 3;

static float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void deep_factor_terms(const struct deep_seen *at, const float wi[3], float term[DEEP_FACTOR])
{
    const float z = at->depth - middle_depth, light_along = dot(wi, at->tangent), view_along = dot(at->wo, at->tangent);
    const float angle[DEEP_FACTOR_ANGLE] = {light_along * light_along,
                                            view_along * view_along,
                                            light_along * view_along,
                                            dot(wi, at->normal),
                                            dot(at->wo, at->normal),
                                            dot(wi, at->wo),
                                            at->normal[2],
                                            fabsf(at->tangent[2]),
                                            wi[2],
                                            at->wo[2],
                                            deep_light_class(at->tangent) == 1 ? 1 : 0};
    term[0] = 1;
    term[1] = z;
    term[2] = z * z;
    term[3] = z * z * z;
    for (int k = 0; k < DEEP_FACTOR_ANGLE; k++) {
        term[4 + k] = angle[k];
        term[4 + DEEP_FACTOR_ANGLE + k] = z * angle[k];
    }
}

void deep_factor_apply(const struct deep_factor *f, const float term[DEEP_FACTOR], float rgb[3])
{
    for (int c = 0; c < 3; c++) {
        float factor = 0;
        for (int k = 0; k < DEEP_FACTOR; k++) factor += f->weight[c][k] * term[k];
        rgb[c] *= fminf(fmaxf(factor, least), most);
    }
}
