/* The fibers of one yarn: staples on a golden-angle spiral in the section, which turns with the twist; and its
 * hairs. */
#include "base/angle.h"
#include "base/rng.h"
#include "geometry/cloth/cloth_film.h"

#include <math.h>
#include <stdlib.h>

static const double GOLDEN_RAD = 2.39996322972865332; /* pi (3 - sqrt 5): Vogel 1979 */
/* Step of the additive recurrence in two dimensions (Roberts 2018, "R2"): the starts of staples are spread over the
 * seam of their yarn, independently of their places in the section. */
static const double START_STEP = 0.7548776662466927;
/* Nodes of a fiber are this many radii apart at the description's own values. */
static const double NODE_STEP_RADII = 1.5;
/* Length, in radii, of the part of a yarn in which its staples begin and end. The places turn with the twist, and one
 * tile seldom holds whole turns, so the places where fibers begin do not fit the places where fibers end. Both are in
 * the section only here. With ends all along the yarn, radiances depended on the length of the tile by 1 to 2 %
 * (optimizer/fit/NOTES.md, "The size of the tile"). */
static const double SEAM_RADII = 24.0;
/* Lengths, in radii, of the longest waves of a fiber about its place, of a section's size, and of a migration. */
static const double WANDER_RADII = 120.0, THICK_RADII = 480.0, MIGRATION_RADII = 150.0;
enum { LEAST_NODES = 12, HAIR_NODES = 24 };

/* A yarn while it is filled. */
struct filling {
    struct cloth_work *w;
    const struct kind_shape *shape;
    const struct yarn *path;
    double nominal_radii; /* length over fiber radius at the description's own values */
    double *length_m;     /* path->n + 1 values: length up to each point of the path */
    double phase_rad;     /* of the whole section */
    struct wave thick;    /* of the section's size along the yarn */
    double disorder;
    double nap[2]; /* shift of hairs over their height above the yarn */
    size_t kind;
};

/* Length of the path up to s, which may exceed one tile. */
static double length_at(const struct filling *y, double s)
{
    double whole = floor(s), at = (s - whole) * (double)y->path->n;
    size_t i = (size_t)at;
    if (i >= y->path->n) i = y->path->n - 1;
    double part = y->length_m[i] + (at - (double)i) * (y->length_m[i + 1] - y->length_m[i]);
    return whole * y->length_m[y->path->n] + part;
}

static status measure_path(struct filling *y, struct error *err)
{
    const struct yarn *p = y->path;
    y->length_m = calloc(p->n + 1, sizeof *y->length_m);
    if (y->length_m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
    for (size_t i = 0; i < p->n; i++) {
        double d2 = 0.0;
        for (int a = 0; a < 3; a++) {
            double next = i + 1 < p->n ? p->point[i + 1][a] : p->point[0][a] + (a < 2 ? p->shift[a] : 0.0);
            d2 += (next - p->point[i][a]) * (next - p->point[i][a]);
        }
        y->length_m[i + 1] = y->length_m[i] + sqrt(d2);
    }
    return STATUS_OK;
}

/* Place of a fiber in its yarn. */
struct place {
    size_t i_ply;
    double rho_m, angle_rad;
};

/* Computes the point of the round section at length_m along the yarn. */
static void round_point(const struct filling *y, const struct place *q, double rho_m, double length_m, double out[2])
{
    const struct kind_shape *k = y->shape;
    double turns = 2.0 * M_PI * k->turn_of_twist * length_m;
    double own = q->angle_rad + y->phase_rad + turns * k->twist_per_m;
    double ply = y->phase_rad + 2.0 * M_PI * (double)q->i_ply / (double)k->n_ply + turns * k->ply_twist_per_m;
    out[0] = k->ply_distance_m * cos(ply) + rho_m * cos(own);
    out[1] = k->ply_distance_m * sin(ply) + rho_m * sin(own);
}

/* Returns the place of fiber i in the section of its yarn. The density in the disc is even, and there is no lattice,
 * which would meet itself at whole twists only. */
static struct place fiber_place(const struct filling *y, size_t i)
{
    const struct kind_shape *k = y->shape;
    size_t n = (k->n_fiber + k->n_ply - 1 - i % k->n_ply) / k->n_ply, j = i / k->n_ply;
    double reach_m = fmax(0.0, k->ply_radius_m - 0.5 * k->radius_m);
    return (struct place){.i_ply = i % k->n_ply,
                          .rho_m = n > 1 ? reach_m * sqrt(((double)j + 0.5) / (double)n) : 0.0,
                          .angle_rad = GOLDEN_RAD * (double)j};
}

/* The long axis of a section that turns with the twist, length_m along the yarn: angle_rad is its angle at 0. */
static void section_axis(const struct filling *y, double angle_rad, double s, double axis[3])
{
    const struct kind_shape *k = y->shape;
    const struct yarn_section as_is = {.wide = 1.0, .high = 1.0};
    double turns = 2.0 * M_PI * k->turn_of_twist * length_at(y, s) * k->twist_per_m, centre[3];
    yarn_point(y->path, &as_is, s, 0.0, 0.0, centre);
    yarn_point(y->path, &as_is, s, cos(angle_rad + turns), sin(angle_rad + turns), axis);
    for (int a = 0; a < 3; a++) axis[a] -= centre[a];
}

/* Where a fiber of the present yarn may differ from its place. */
struct wander {
    struct wave side[2];
    double amplitude_m, migration_turns, migration_rad;
};

static void draw_wander(const struct filling *y, struct wander *v, struct rng *rng)
{
    double longest = y->nominal_radii / WANDER_RADII;
    for (int a = 0; a < 2; a++) wave_draw_band(&v->side[a], longest, 0.5 * longest, rng);
    double slope = hypot(wave_slope_sd(&v->side[0]), wave_slope_sd(&v->side[1]));
    v->amplitude_m = tan(y->shape->fiber_angle_rad) * y->length_m[y->path->n] / slope;
    v->migration_turns = y->nominal_radii / MIGRATION_RADII * (0.7 + 0.6 * rng_double(rng));
    v->migration_rad = 2.0 * M_PI * rng_double(rng);
}

/* Share of fiber i that belongs to the other kind of a melange. Fibers change over one after the other, in an order
 * that is spread over the section; the last one changes in part, so that the share moves smoothly. */
static double melange_share(const struct kind_shape *k, size_t i)
{
    static const double step = 0.5698402909980532; /* the second step of R2 */
    double own = step * (double)(i + 1) - floor(step * (double)(i + 1));
    size_t rank = 0;
    for (size_t j = 0; j < k->n_fiber; j++) rank += step * (double)(j + 1) - floor(step * (double)(j + 1)) < own;
    return fmax(0.0, fmin(1.0, k->melange * (double)k->n_fiber - (double)rank));
}

static size_t staple_nodes(double nominal_radii)
{
    size_t n = (size_t)ceil(nominal_radii / NODE_STEP_RADII);
    return n > LEAST_NODES ? n : LEAST_NODES;
}

static status add_staple(struct filling *y, size_t i, double start, struct error *err)
{
    const struct rng_key key = {.seed = y->w->d->seed, .iteration = STREAM_STAPLE};
    const struct kind_shape *k = y->shape;
    struct place q = fiber_place(y, i);
    struct wander v;
    struct rng rng;
    double z[2], (*node)[3];
    rng_start(&rng, &key, y->path->number, (uint32_t)i);
    rng_normal_pair(&rng, z);
    draw_wander(y, &v, &rng);
    size_t n = staple_nodes(y->nominal_radii);
    struct strand like = {.radius_m = k->radius_m * fmax(0.3, 1.0 + k->radius_spread * fmax(-2.0, fmin(2.0, z[0]))),
                          .ratio = k->fiber_flatness,
                          .axis_class = y->path->axis_class,
                          .group = (uint8_t)y->kind,
                          .cut = y->path->cut};
    if (k->melange_with >= 0) {
        like.start_share = melange_share(k, i);
        like.group_of_start = (uint8_t)k->melange_with;
    }
    status st = strand_add(&y->w->set, &like, n, &node, err);
    if (st != STATUS_OK) return st;
    double(*axis)[3] = strand_axis(&y->w->set), angle_rad = strand_section_rad(key.seed, y->path->number, (uint32_t)i);
    for (size_t j = 0; j < n; j++) {
        double t = (double)j / (double)(n - 1), s = start + t, at[2];
        if (axis != NULL) section_axis(y, angle_rad, s, axis[j]);
        double scale = 1.0 + y->disorder * wave_at(&y->thick, s);
        double rho_m = q.rho_m * (1.0 + k->migration * cos(2.0 * M_PI * v.migration_turns * t + v.migration_rad));
        round_point(y, &q, rho_m, length_at(y, s), at);
        const struct yarn_section section = {.wide = sqrt(k->flatness) * scale, .high = scale / sqrt(k->flatness)};
        yarn_point(y->path, &section, s, at[0] + v.amplitude_m * wave_at(&v.side[0], t) / section.wide,
                   at[1] + v.amplitude_m * wave_at(&v.side[1], t) / section.high, node[j]);
    }
    return STATUS_OK;
}

/* Adds hair number i, grown to the given share of its length: it leaves the surface of the yarn and curls. Lengths
 * are exponentially distributed, cut off at three means. */
static status add_hair(struct filling *y, size_t i, double grown, struct error *err)
{
    const struct rng_key key = {.seed = y->w->d->seed, .iteration = STREAM_HAIR};
    const struct kind_shape *k = y->shape;
    struct rng rng;
    rng_start(&rng, &key, y->path->number, (uint32_t)i);
    double from = rng_double(&rng), angle = 2.0 * M_PI * rng_double(&rng), side = rng_double(&rng) < 0.5 ? -1.0 : 1.0;
    double length_m = grown * k->hair_length_m * -log(1.0 - 0.87 * rng_double(&rng)) / 0.695,
           rise = 0.1 + 0.7 * rng_double(&rng);
    double curl = 2.0 * (rng_double(&rng) - 0.5), bend = 0.6 + rng_double(&rng), (*node)[3];
    if (length_m < 2.0 * k->radius_m) return STATUS_OK;
    struct strand like = {.radius_m = k->radius_m,
                          .ratio = k->fiber_flatness,
                          .axis_class = y->path->axis_class,
                          .group = (uint8_t)y->kind,
                          .hair = true,
                          .cut = CUT_NONE};
    status st = work_has_room(y->w, HAIR_NODES, err);
    if (st == STATUS_OK) st = strand_add(&y->w->set, &like, HAIR_NODES, &node, err);
    if (st != STATUS_OK) return st;
    double(*axis)[3] = strand_axis(&y->w->set), angle_rad = strand_section_rad(key.seed, y->path->number, ~(uint32_t)i);
    double along = side * cos(rise) * length_m / y->length_m[y->path->n], out_m = sin(rise) * length_m;
    for (size_t j = 0; j < HAIR_NODES; j++) {
        double t = (double)j / (HAIR_NODES - 1), turned = angle + curl * t;
        double above_m = out_m * pow(t, bend);
        const struct yarn_section as_is = {.wide = 1.0, .high = 1.0};
        yarn_point(y->path, &as_is, from + along * t, (k->half_m[0] + above_m) * cos(turned),
                   (k->half_m[1] + above_m) * sin(turned), node[j]);
        for (int a = 0; a < 2; a++) node[j][a] += above_m * y->nap[a];
        if (axis != NULL) section_axis(y, angle_rad, from, axis[j]);
    }
    return STATUS_OK;
}

/* The number of hairs is not whole: the last one is as long as the fraction says, so that hairs grow one after the
 * other when the number rises. */
static status add_hairs(struct filling *y, struct error *err)
{
    double n = y->shape->hairs_per_m * y->length_m[y->path->n];
    status st = STATUS_OK;
    for (size_t i = 0; (double)i < n && st == STATUS_OK; i++) st = add_hair(y, i, fmin(1.0, n - (double)i), err);
    return st;
}

size_t yarn_nodes(const struct cloth_work *w, size_t kind, double nominal_m)
{
    return w->kind[kind].n_fiber * staple_nodes(nominal_m / w->nominal[kind].radius_m);
}

status yarn_fill(struct cloth_work *w, size_t kind, const struct yarn *path, double nominal_m, struct error *err)
{
    const struct rng_key key = {.seed = w->d->seed, .iteration = STREAM_YARN};
    struct filling y = {.w = w, .shape = &w->kind[kind], .path = path, .kind = kind};
    struct rng rng;
    rng_start(&rng, &key, path->number, 0);
    y.nominal_radii = nominal_m / w->nominal[kind].radius_m;
    y.phase_rad = 2.0 * M_PI * rng_double(&rng);
    y.disorder = work_number(w, "disorder");
    double lean = tan(RAD_PER_DEG * work_number(w, "nap_tilt_deg")),
           towards = RAD_PER_DEG * work_number(w, "nap_direction_deg");
    y.nap[0] = lean * cos(towards);
    y.nap[1] = lean * sin(towards);
    wave_draw_band(&y.thick, y.nominal_radii / THICK_RADII, y.nominal_radii / THICK_RADII, &rng);
    double start = rng_double(&rng), seam = fmin(1.0, SEAM_RADII / y.nominal_radii);
    status st = work_has_room(w, yarn_nodes(w, kind, nominal_m), err);
    if (st == STATUS_OK) st = measure_path(&y, err);
    for (size_t i = 0; i < y.shape->n_fiber && st == STATUS_OK; i++) {
        double spread = START_STEP * (double)i, at = start + seam * (spread - floor(spread));
        st = add_staple(&y, i, at - floor(at), err);
    }
    if (st == STATUS_OK && y.shape->n_fiber > 0) st = add_hairs(&y, err);
    if (st == STATUS_OK && w->d->kind[kind].film.width_um > 0.0) st = cloth_film_wrap(w, kind, path, nominal_m, err);
    free(y.length_m);
    return st;
}
