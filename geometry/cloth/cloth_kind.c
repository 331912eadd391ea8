/* The kinds of yarn at given numbers: their sections; and smooth random waves. */
#include "base/angle.h"
#include "base/rng.h"
#include "geometry/cloth/cloth_work.h"

#include <math.h>

static double of_kind(const struct cloth_work *w, const double *number, size_t k, const char *name, double none)
{
    double value = cloth_number_value(w->d, number, (int)k, name);
    return isnan(value) ? none : value;
}

double work_number(const struct cloth_work *w, const char *name)
{
    return cloth_number_value(w->d, w->number, -1, name);
}

status work_has_room(const struct cloth_work *w, size_t n_more, struct error *err)
{
    if (w->set.n_node + n_more <= MAX_CLOTH_NODES) return STATUS_OK;
    return error_set(err, STATUS_TOO_LARGE,
                     "the described cloth has more than %d vertices: take fewer yarns in the tile, fewer fibers in a "
                     "yarn, or fewer hairs",
                     MAX_CLOTH_NODES);
}

/* Area-preserving: an ellipse of the area of the round section. Its fibers circulate with a constant rate of the
 * eccentric angle, which keeps their density even. The rate is lowered by round_m / half width, so that fibers on the
 * flat side lie at the same angle to the yarn as on the surface of the round yarn. */
static void flatten(struct kind_shape *s)
{
    s->half_m[0] = s->round_m * sqrt(s->flatness);
    s->half_m[1] = s->round_m / sqrt(s->flatness);
    s->turn_of_twist = 1.0 / sqrt(s->flatness);
}

/* A film makes its yarn thicker; one without a core is the yarn itself, which turns fill out to a round. */
static void add_film(const struct cloth_film *film, struct kind_shape *s)
{
    for (int a = 0; a < 2; a++) s->core_half_m[a] = s->half_m[a];
    s->outer_m = s->round_m;
    if (!(film->width_um > 0.0)) return;
    if (s->n_fiber > 0) {
        for (int a = 0; a < 2; a++) s->half_m[a] += 1e-6 * film->thickness_um;
        s->outer_m += 1e-6 * film->thickness_um;
    } else {
        s->outer_m = s->half_m[0] = 0.5e-6 * film->width_um;
        s->half_m[1] = film->wraps_per_m != 0.0 ? s->half_m[0] : 0.5e-6 * film->thickness_um;
    }
}

static void shape(const struct cloth_work *w, const double *number, size_t k, struct kind_shape *s)
{
    const struct cloth_kind *kind = &w->d->kind[k];
    *s = (struct kind_shape){.n_fiber = kind->n_fiber,
                             .n_ply = kind->n_ply,
                             .melange_with = kind->melange_with,
                             .radius_m = 1e-6 * of_kind(w, number, k, "fiber_radius_um", 8.0),
                             .radius_spread = of_kind(w, number, k, "radius_spread", 0.0),
                             .fiber_flatness = of_kind(w, number, k, "fiber_flatness", 1.0),
                             .packing = of_kind(w, number, k, "packing", 0.6),
                             .flatness = of_kind(w, number, k, "flatness", 1.0),
                             .twist_per_m = of_kind(w, number, k, "twist_per_m", 0.0),
                             .ply_twist_per_m = of_kind(w, number, k, "ply_twist_per_m", 0.0),
                             .migration = of_kind(w, number, k, "migration", 0.0),
                             .fiber_angle_rad = RAD_PER_DEG * of_kind(w, number, k, "fiber_angle_deg", 0.0),
                             .hairs_per_m = 1e3 * of_kind(w, number, k, "hairs_per_mm", 0.0),
                             .hair_length_m = 1e-6 * of_kind(w, number, k, "hair_length_um", 0.0),
                             .melange = of_kind(w, number, k, "melange", 0.0)};
    const double per_ply = (double)s->n_fiber / (double)s->n_ply;
    s->ply_radius_m = s->radius_m * sqrt(per_ply / s->packing);
    if (s->n_ply > 1) s->ply_distance_m = s->ply_radius_m / sin(M_PI / (double)s->n_ply);
    s->round_m = s->ply_radius_m + s->ply_distance_m;
    flatten(s);
    add_film(&kind->film, s);
}

void kind_shapes(struct cloth_work *w)
{
    for (size_t k = 0; k < w->d->n_kind; k++) {
        shape(w, w->number, k, &w->kind[k]);
        shape(w, NULL, k, &w->nominal[k]);
        if (w->kind[k].fiber_flatness > 1.0) w->set.flat = true;
    }
}

void wave_draw(struct wave *v, double n_least, struct rng *rng)
{
    for (int i = 0; i < N_WAVE; i++) {
        double z[2];
        rng_normal_pair(rng, z);
        v->a[i] = z[0] / sqrt(N_WAVE);
        v->b[i] = z[1] / sqrt(N_WAVE);
        v->k[i] = n_least + i;
    }
}

void wave_draw_band(struct wave *v, double n_longest, double step, struct rng *rng)
{
    wave_draw(v, 0.0, rng);
    for (int i = 0; i < N_WAVE; i++) v->k[i] = fmax(1.0, round(n_longest + step * ((double)i - 0.5 + rng_double(rng))));
}

double wave_at(const struct wave *v, double s)
{
    double sum = 0.0;
    for (int i = 0; i < N_WAVE; i++) {
        double turn = 2.0 * M_PI * v->k[i] * s;
        sum += v->a[i] * cos(turn) + v->b[i] * sin(turn);
    }
    return sum;
}

double wave_slope_sd(const struct wave *v)
{
    double sum = 0.0;
    for (int i = 0; i < N_WAVE; i++) sum += 4.0 * M_PI * M_PI * v->k[i] * v->k[i] / N_WAVE;
    return sqrt(sum);
}
