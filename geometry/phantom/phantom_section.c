#include "geometry/phantom/phantom_section.h"

#include "base/rng.h"
#include "geometry/cloth/strand.h"

#include <math.h>
#include <string.h>

bool phantom_section_is_disc(const struct phantom_section_law *law)
{
    return law->lumen <= 0.0 && law->aspect <= 1.0 && law->bean <= 0.0;
}

status phantom_section_check(const struct phantom_section_law *law, struct error *err)
{
    const struct {
        const char *field;
        double value, lower, upper;
    } range[] = {{"lumen", law->lumen, 0.0, 0.8}, {"aspect", law->aspect, 0.0, 4.0},
                 {"bean", law->bean, 0.0, 0.5},   {"turns_per_m", law->turns_per_m, 0.0, 1e5},
                 {"taper", law->taper, 0.0, 0.5}, {"lumen_spread", law->lumen_spread, 0.0, 1.0}};
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
    const double narrower = law->lumen_spread * rng_double(&rng);
    return (struct phantom_section){.lumen = law->lumen * (1.0 - narrower),
                                    .aspect = 1.0 + stretch * fmax(0.0, law->aspect - 1.0),
                                    .bean = law->bean,
                                    .angle_rad = angle_rad,
                                    .turn_rad_per_m = side * 2.0 * M_PI * law->turns_per_m};
}

void phantom_section_frame(const double t[3], uint8_t axis_class, double across[2][3])
{
    const double ref[3] = {axis_class == 2 ? 1.0 : 0.0, 0.0, axis_class == 2 ? 0.0 : 1.0};
    double across2 = 0.0, *e = across[0], *o = across[1];
    for (int a = 0; a < 3; a++) {
        e[a] = ref[(a + 1) % 3] * t[(a + 2) % 3] - ref[(a + 2) % 3] * t[(a + 1) % 3];
        across2 += e[a] * e[a];
    }
    for (int a = 0; a < 3; a++) e[a] = across2 > 1e-12 ? e[a] / sqrt(across2) : a == 1 ? 1.0 : 0.0;
    for (int a = 0; a < 3; a++) o[a] = t[(a + 1) % 3] * e[(a + 2) % 3] - t[(a + 2) % 3] * e[(a + 1) % 3];
}

/* Phase of the taper: taken from the radius, which pieces of a fiber at the faces share. */
static double taper_phase(const struct phantom_section_law *law, float radius_m)
{
    const struct rng_key key = {.seed = law->seed, .iteration = STREAM_SECTION};
    struct rng rng;
    uint32_t bits;
    memcpy(&bits, &radius_m, sizeof bits);
    rng_start(&rng, &key, bits, 1);
    return 2.0 * M_PI * rng_double(&rng);
}

/* Unit vector along a fiber from vertex k to the next, or to it from the last; *length_m: to the next. */
static void direction_at(const struct fiber_set *f, size_t k, size_t last, double t[3], double *length_m)
{
    const float *p = f->position_m + 3 * (k < last ? k : k - 1);
    double square = 0.0;
    for (int a = 0; a < 3; a++) {
        t[a] = (double)p[3 + a] - (double)p[a];
        square += t[a] * t[a];
    }
    *length_m = k < last ? sqrt(square) : 0.0;
    for (int a = 0; a < 3; a++) t[a] /= square > 0.0 ? sqrt(square) : 1.0;
}

static void shape_fiber(const struct phantom_section_law *law, struct fiber_set *f, size_t i)
{
    const struct phantom_section section = phantom_section_of(law, i);
    const double r = (double)f->radius_m[i], phase = taper_phase(law, f->radius_m[i]);
    const size_t first = f->first_vertex[i], last = f->first_vertex[i + 1] - 1;
    double along_m = 0.0, sum = 0.0;
    for (size_t k = first; k <= last; k++) {
        const float *p = f->position_m + 3 * k;
        double t[3], across[2][3], length_m;
        direction_at(f, k, last, t, &length_m);
        phantom_section_frame(t, f->axis_class[i], across);
        const double angle = section.angle_rad + along_m * section.turn_rad_per_m,
                     turns = (double)p[0] / f->tile_size_m[0] + (double)p[1] / f->tile_size_m[1];
        struct fiber_shape *s = &f->shape[k];
        s->radius = (float)(r * (1.0 - 0.5 * law->taper * (1.0 - cos(2.0 * M_PI * turns + phase))));
        s->ratio = (float)section.aspect;
        s->lumen = (float)section.lumen;
        for (int a = 0; a < 3 && section.aspect > 1.0; a++)
            s->long_axis[a] = (float)(cos(angle) * across[0][a] + sin(angle) * across[1][a]);
        along_m += length_m;
        sum += (double)s->radius;
    }
    f->radius_m[i] = (float)(sum / (double)(last - first + 1));
}

status phantom_section_shapes(const struct phantom_section_law *law, struct fiber_set *f, struct error *err)
{
    if (law->aspect <= 1.0 && law->taper <= 0.0 && law->lumen <= 0.0) return STATUS_OK;
    status s = fiber_set_add_shapes(f, err);
    for (size_t i = 0; i < f->n_fiber && s == STATUS_OK; i++) shape_fiber(law, f, i);
    return s;
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
