#include "geometry/phantom/phantom_section.h"

#include "base/rng.h"
#include "geometry/cloth/strand.h"

#include <math.h>

bool phantom_section_is_disc(const struct phantom_section_law *law)
{
    return law->lumen <= 0.0 && law->aspect <= 1.0 && law->bean <= 0.0;
}

status phantom_section_check(const struct phantom_section_law *law, struct error *err)
{
    const struct {
        const char *field;
        double value, lower, upper;
    } range[] = {{"lumen", law->lumen, 0.0, 0.8},
                 {"aspect", law->aspect, 0.0, 4.0},
                 {"bean", law->bean, 0.0, 0.5},
                 {"turns_per_m", law->turns_per_m, 0.0, 1e5}};
    for (size_t i = 0; i < sizeof range / sizeof *range; i++)
        if (!(range[i].value >= range[i].lower && range[i].value <= range[i].upper))
            return error_set_field(err, STATUS_INVALID, range[i].field,
                                   "sections with %s %g: it must be between %g and %g", range[i].field, range[i].value,
                                   range[i].lower, range[i].upper);
    return STATUS_OK;
}

struct phantom_section phantom_section_of(const struct phantom_section_law *law, size_t i_fiber)
{
    const struct rng_key key = {.seed = law->seed, .iteration = STREAM_SECTION};
    struct rng rng;
    rng_start(&rng, &key, (uint32_t)i_fiber, 0);
    double stretch = rng_double(&rng), angle_rad = M_PI * rng_double(&rng), side = rng_double(&rng) < 0.5 ? -1.0 : 1.0;
    return (struct phantom_section){.lumen = law->lumen,
                                    .aspect = 1.0 + stretch * fmax(0.0, law->aspect - 1.0),
                                    .bean = law->bean,
                                    .angle_rad = angle_rad,
                                    .turn_rad_per_m = side * 2.0 * M_PI * law->turns_per_m};
}

double phantom_section_spacing(const struct phantom_section_law *law)
{
    return pow(0.5 * (1.0 + fmax(1.0, law->aspect)), 0.25);
}

/* Share inside the section of radius r without its lumen. */
static double full_share(const struct phantom_section *c, double r, double u, double v)
{
    /* the radius of the ramp that preserves the area, and its height for sections thinner than the ramp */
    double ramp = sqrt(fmax(0.0, r * r - 1.0 / 12.0)), height = 1.0;
    if (ramp < 0.5) {
        ramp = 0.5;
        height = 3.0 * r * r;
    }
    double a = ramp * sqrt(c->aspect), b = ramp / sqrt(c->aspect);
    v -= c->bean * (u * u / a - 0.25 * a);
    double f2 = u * u / (a * a) + v * v / (b * b), along_v = v / (b * b),
           along_u = u / (a * a) - along_v * c->bean * 2.0 * u / a, slope = sqrt(along_u * along_u + along_v * along_v);
    double outside = slope > 0.0 ? (f2 - sqrt(f2)) / slope : -b;
    return height * fmax(0.0, fmin(1.0, 0.5 - outside));
}

double phantom_section_share(const struct phantom_section *c, double r, double u, double v)
{
    double share = full_share(c, r, u, v);
    return c->lumen > 0.0 && share > 0.0 ? fmax(0.0, share - full_share(c, c->lumen * r, u, v)) : share;
}

double phantom_section_reach(const struct phantom_section *c, double r)
{
    return fmax(0.5, r) * sqrt(c->aspect) * (1.0 + c->bean) + 0.5;
}
