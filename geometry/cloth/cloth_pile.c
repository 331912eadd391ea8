/* The pile of a velvet: a tuft in each gap between four ground yarns. Its fibers rise, spread and lean over. */
#include "base/angle.h"
#include "base/rng.h"
#include "geometry/cloth/cloth_work.h"

#include <math.h>

enum { PILE_NODES = 32 };

struct pile {
    struct cloth_work *w;
    double ground_m, height_m, tilt_rad, direction_rad, spread_rad;
};

/* Adds fiber i of a tuft: upright at the root, and leaning by its tilt from the middle of its length on. The tilt is a
 * vector in the plane, so that the spread has no preferred side. */
static status add_fiber(const struct pile *p, const double root_m[2], uint32_t tuft, size_t i, double turn_rad,
                        struct error *err)
{
    const struct rng_key key = {.seed = p->w->d->seed, .iteration = STREAM_NAP};
    const struct kind_shape *k = &p->w->kind[p->w->d->pile_kind];
    struct rng rng;
    double z[2], u[2], (*node)[3];
    rng_start(&rng, &key, tuft, (uint32_t)(i + 1));
    rng_normal_pair(&rng, z);
    rng_normal_pair(&rng, u);
    double lean[2] = {p->tilt_rad * cos(p->direction_rad) + p->spread_rad * z[0],
                      p->tilt_rad * sin(p->direction_rad) + p->spread_rad * z[1]};
    double tilt = hypot(lean[0], lean[1]), towards[2] = {0.0, 0.0};
    for (int a = 0; a < 2 && tilt > 1e-12; a++) towards[a] = lean[a] / tilt;
    tilt = fmin(tilt, 0.48 * M_PI);
    double rho_m = k->radius_m * 1.9 * sqrt((double)i + 0.5), angle = turn_rad + 2.39996322972865332 * (double)i;
    double length_m = (p->height_m + p->ground_m) * (1.0 + 0.04 * fmax(-2.0, fmin(2.0, u[0])));
    struct strand like = {.radius_m = k->radius_m * fmax(0.3, 1.0 + k->radius_spread * fmax(-2.0, fmin(2.0, u[1]))),
                          .ratio = k->fiber_flatness,
                          .axis_class = 2,
                          .group = (uint8_t)p->w->d->pile_kind,
                          .cut = CUT_NONE};
    status st = strand_add(&p->w->set, &like, PILE_NODES, &node, err);
    if (st != STATUS_OK) return st;
    double(*axis)[3] = strand_axis(&p->w->set), flat_rad = strand_section_rad(key.seed, ~tuft, (uint32_t)i);
    double at[3] = {root_m[0] + rho_m * cos(angle), root_m[1] + rho_m * sin(angle), -0.5 * p->ground_m};
    for (size_t j = 0; j < PILE_NODES; j++) {
        double t = (double)j / (PILE_NODES - 1), bend = fmin(1.0, 2.0 * t),
               now = tilt * bend * bend * (3.0 - 2.0 * bend);
        double spread = 1.0 + 0.8 * t, step_m = length_m / (PILE_NODES - 1);
        node[j][0] = at[0] + (spread - 1.0) * rho_m * cos(angle);
        node[j][1] = at[1] + (spread - 1.0) * rho_m * sin(angle);
        node[j][2] = at[2];
        for (int a = 0; a < 2 && axis != NULL; a++) axis[j][a] = a == 0 ? cos(flat_rad) : sin(flat_rad);
        for (int a = 0; a < 2; a++) at[a] += step_m * sin(now) * towards[a];
        at[2] += step_m * cos(now);
    }
    return STATUS_OK;
}

status cloth_pile(struct cloth_work *w, const double *x_m, const double *y_m, double ground_m, struct error *err)
{
    const struct cloth_description *d = w->d;
    const struct rng_key key = {.seed = d->seed, .iteration = STREAM_NAP};
    const struct pile p = {.w = w,
                           .ground_m = ground_m,
                           .height_m = 1e-6 * work_number(w, "pile_height_um"),
                           .tilt_rad = RAD_PER_DEG * work_number(w, "pile_tilt_deg"),
                           .direction_rad = RAD_PER_DEG * work_number(w, "pile_direction_deg"),
                           .spread_rad = RAD_PER_DEG * work_number(w, "pile_spread_deg")};
    size_t n_tuft = d->n_yarn[CLOTH_WEFT] * d->n_yarn[CLOTH_WARP];
    status st = work_has_room(w, n_tuft * d->kind[d->pile_kind].n_fiber * PILE_NODES, err);
    for (size_t i = 0; i < d->n_yarn[CLOTH_WEFT]; i++)
        for (size_t j = 0; j < d->n_yarn[CLOTH_WARP]; j++) {
            uint32_t tuft = (uint32_t)(i * d->n_yarn[CLOTH_WARP] + j);
            struct rng rng;
            rng_start(&rng, &key, tuft, 0);
            double turn_rad = 2.0 * M_PI * rng_double(&rng), root_m[2] = {x_m[j], y_m[i]};
            for (size_t k = 0; k < d->kind[d->pile_kind].n_fiber && st == STATUS_OK; k++)
                st = add_fiber(&p, root_m, tuft, k, turn_rad, err);
            if (st != STATUS_OK) return st;
        }
    return st;
}
