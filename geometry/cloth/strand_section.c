/* Flat sections of strands: their angles, and the sections of the fibers that are made of them. */
#include "base/rng.h"
#include "geometry/cloth/strand.h"

#include <math.h>

double (*strand_axis(const struct strand_set *s))[3]
{
    return s->axis != NULL ? s->axis + s->strand[s->n_strand - 1].first : NULL;
}

double strand_section_rad(uint64_t seed, uint32_t i_yarn, uint32_t i_fiber)
{
    const struct rng_key key = {.seed = seed, .iteration = STREAM_FLAT};
    struct rng rng;
    rng_start(&rng, &key, i_yarn, i_fiber);
    return M_PI * rng_double(&rng);
}

/* The part of the long axis that is perpendicular to the fiber between vertices k and m, as a unit vector. False where
 * the axis lies along the fiber. */
static bool across(const struct fiber_set *f, size_t k, size_t m, const float axis[3], float out[3])
{
    double t[3], along = 0.0, t2 = 0.0, length2 = 0.0, v[3];
    for (int a = 0; a < 3; a++) {
        t[a] = (double)f->position_m[3 * m + (size_t)a] - (double)f->position_m[3 * k + (size_t)a];
        along += t[a] * (double)axis[a];
        t2 += t[a] * t[a];
    }
    for (int a = 0; a < 3; a++) {
        v[a] = (double)axis[a] - (t2 > 0.0 ? along / t2 * t[a] : 0.0);
        length2 += v[a] * v[a];
    }
    if (!(length2 > 1e-6)) return false;
    for (int a = 0; a < 3; a++) out[a] = (float)(v[a] / sqrt(length2));
    return true;
}

status strand_set_sections(const struct strand_section *section, struct fiber_set *f, struct error *err)
{
    status s = fiber_set_add_shapes(f, err);
    for (size_t i = 0; i < f->n_fiber && s == STATUS_OK; i++) {
        const size_t first = f->first_vertex[i], last = f->first_vertex[i + 1] - 1;
        for (size_t k = first; k <= last; k++) {
            if (section[k].ratio <= 1.0f) continue;
            f->shape[k].ratio = section[k].ratio;
            across(f, k > first ? k - 1 : k, k < last ? k + 1 : k, section[k].axis, f->shape[k].long_axis);
        }
    }
    return s;
}
