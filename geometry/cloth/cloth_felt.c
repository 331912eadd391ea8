/* Felt: fibers in all directions of the plane, at all depths. The edge of the tile follows from the number of fibers,
 * the density and the thickness, so that a change of the density leaves the number of fibers unchanged. */
#include "base/angle.h"
#include "base/rng.h"
#include "geometry/cloth/cloth_work.h"

#include <math.h>

/* Length of a fiber, in radii, and layers of a layered felt. */
static const double LENGTH_RADII = 150.0, LAYERS = 6.0;
enum { FELT_NODES = 90 };

struct web {
    struct cloth_work *w;
    const struct kind_shape *kind;
    double thickness_m, tilt_rad, layering, curl, length_m;
    struct wave heading; /* of the layers, over the depth */
};

/* Folds a height that left the felt back into it, smoothly: a triangle wave of period 4 with rounded tips. */
static double fold(double h) { return asin(0.985 * sin(0.5 * M_PI * h)) / asin(0.985); }

static status add_fiber(struct web *b, size_t i, struct error *err)
{
    const struct rng_key key = {.seed = b->w->d->seed, .iteration = STREAM_FELT};
    const double *tile_m = b->w->set.tile_m;
    struct rng rng;
    struct wave turn;
    double z[2], u[2], (*node)[3];
    rng_start(&rng, &key, (uint32_t)i, 0);
    rng_normal_pair(&rng, z);
    rng_normal_pair(&rng, u);
    double at[3] = {rng_double(&rng) * tile_m[0], rng_double(&rng) * tile_m[1], 2.0 * rng_double(&rng) - 1.0};
    double free_rad = 2.0 * M_PI * rng_double(&rng), layer = 0.5 * LAYERS * (at[2] + 1.0);
    wave_draw(&turn, 0.5, &rng);
    /* the heading is a direction without sign: the layer's, and about it a spread that layering narrows */
    double heading = M_PI * wave_at(&b->heading, 0.02 * layer) + (1.0 - b->layering) * (free_rad - M_PI);
    double radius_m = b->kind->radius_m * fmax(0.3, 1.0 + b->kind->radius_spread * fmax(-2.0, fmin(2.0, z[1])));
    double half_m = fmax(0.5 * b->thickness_m - radius_m, 0.1 * b->thickness_m);
    double tilt = fmax(-0.45 * M_PI, fmin(0.45 * M_PI, b->tilt_rad * z[0])), step_m = b->length_m / (FELT_NODES - 1);
    struct strand like = {.radius_m = radius_m, .ratio = b->kind->fiber_flatness, .cut = CUT_FACE_XY};
    status st = work_has_room(b->w, FELT_NODES, err);
    if (st == STATUS_OK) st = strand_add(&b->w->set, &like, FELT_NODES, &node, err);
    if (st != STATUS_OK) return st;
    double(*axis)[3] = strand_axis(&b->w->set), flat_rad = strand_section_rad(key.seed, 0, (uint32_t)i);
    for (size_t j = 0; j < FELT_NODES; j++) {
        double now = heading + b->curl * wave_at(&turn, (double)j / FELT_NODES);
        node[j][0] = at[0];
        node[j][1] = at[1];
        node[j][2] = half_m * fold(at[2]);
        if (axis != NULL) {
            axis[j][0] = -sin(now) * cos(flat_rad);
            axis[j][1] = cos(now) * cos(flat_rad);
            axis[j][2] = sin(flat_rad);
        }
        at[0] += step_m * cos(tilt) * cos(now);
        at[1] += step_m * cos(tilt) * sin(now);
        at[2] += step_m * sin(tilt) / half_m;
    }
    struct strand *s = &b->w->set.strand[b->w->set.n_strand - 1];
    s->axis_class = fabs(sin(heading)) > fabs(cos(heading)) ? 1 : 0;
    return STATUS_OK;
}

status cloth_felt(struct cloth_work *w, struct error *err)
{
    const struct rng_key key = {.seed = w->d->seed, .iteration = STREAM_WEB};
    struct web b = {.w = w,
                    .kind = &w->kind[0],
                    .thickness_m = 1e-6 * work_number(w, "thickness_um"),
                    .tilt_rad = RAD_PER_DEG * work_number(w, "tilt_spread_deg"),
                    .layering = work_number(w, "layering"),
                    .curl = work_number(w, "curl")};
    struct rng rng;
    rng_start(&rng, &key, 0, 0);
    wave_draw(&b.heading, 1.0, &rng);
    b.length_m = LENGTH_RADII * b.kind->radius_m;
    size_t n = w->d->kind[0].n_fiber;
    double volume_m3 = (double)n * b.length_m * M_PI * b.kind->radius_m * b.kind->radius_m;
    w->set.tile_m[0] = w->set.tile_m[1] = sqrt(volume_m3 / (work_number(w, "density") * b.thickness_m));
    status st = STATUS_OK;
    for (size_t i = 0; i < n && st == STATUS_OK; i++) st = add_fiber(&b, i, err);
    return st;
}
