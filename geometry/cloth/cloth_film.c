#include "geometry/cloth/cloth_film.h"

#include "base/angle.h"
#include "base/rng.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Nodes in a turn of a wrapped film, and in half the rim of a sequin. */
enum { NODES_PER_TURN = 24, NODES_PER_DISC = 28 };
/* Nodes of a film are at most this many radii of the disc of equal area apart. */
static const double STEP_RADII = 1.5;

static const double um = 1e-6;

static status reserve(struct cloth_work *w, size_t n, struct error *err)
{
    status s = work_has_room(w, w->film.n + n, err);
    if (s != STATUS_OK || w->film.n + n <= w->film.capacity) return s;
    const size_t capacity = 2 * w->film.capacity + n;
    void *grown = realloc(w->film.node, capacity * sizeof *w->film.node);
    if (grown == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the films: out of memory");
    w->film.node = grown;
    w->film.capacity = capacity;
    return STATUS_OK;
}

/* A film on its yarn. */
struct wrap {
    const struct yarn *path;
    double reach_m[2]; /* semi-axes of the ellipse on which its middle runs; 0 of a film without a core */
    double phase_rad, turns;
};

/* The middle of the film s tiles along the yarn, and the normal of its flat side where it has a core. */
static void film_at(const struct wrap *f, double s, double p[3], double normal[3])
{
    const struct yarn_section as_is = {.wide = 1.0, .high = 1.0};
    const double a = f->phase_rad + 2.0 * M_PI * f->turns * s, c = cos(a), d = sin(a);
    double middle[3], beyond[3];
    yarn_point(f->path, &as_is, s, f->reach_m[0] * c, f->reach_m[1] * d, p);
    if (normal == NULL) return;
    yarn_point(f->path, &as_is, s, 0.0, 0.0, middle);
    if (f->reach_m[0] > 0.0)
        yarn_point(f->path, &as_is, s, f->reach_m[1] * c, f->reach_m[0] * d, beyond);
    else
        yarn_point(f->path, &as_is, s, -d, c, beyond); /* flat in the cloth where a is 0 */
    for (int x = 0; x < 3; x++) normal[x] = beyond[x] - middle[x];
}

/* Number of segments of a film of the length length_m on a yarn of the length nominal_m, at the description's own
 * values. A segment has one section: the next one's is turned against it by the torsion, so its edge is a step higher,
 * of at most half of the thickness. Across larger steps rays would slip through the film. */
static size_t n_segment_of(const struct wrap *f, const double half_m[2], double length_m, double nominal_m)
{
    const double turn_rad = 2.0 * M_PI * fabs(f->turns) * nominal_m / length_m;
    double n = fmax(nominal_m / (STEP_RADII * sqrt(half_m[0] * half_m[1])), (double)f->path->n);
    n = fmax(n, NODES_PER_TURN * fabs(f->turns));
    return (size_t)ceil(fmax(n, turn_rad * half_m[0] / half_m[1]));
}

status cloth_film_wrap(struct cloth_work *w, size_t kind, const struct yarn *path, double nominal_m, struct error *err)
{
    const struct cloth_film *film = &w->d->kind[kind].film;
    const struct kind_shape *k = &w->kind[kind];
    const double half_m[2] = {0.5 * um * film->width_um, 0.5 * um * film->thickness_um};
    struct wrap f = {.path = path, .turns = round(film->wraps_per_m * nominal_m)};
    const double *core_m = w->nominal[kind].core_half_m; /* 0 of a film without a core */
    const double around_m = 2.0 * M_PI * f.turns * sqrt(0.5 * (core_m[0] * core_m[0] + core_m[1] * core_m[1]));
    const double length_m = hypot(nominal_m, around_m);
    if (k->n_fiber > 0) {
        const struct rng_key key = {.seed = w->d->seed, .iteration = STREAM_FILM};
        struct rng rng;
        rng_start(&rng, &key, path->number, 0);
        f.phase_rad = 2.0 * M_PI * rng_double(&rng);
        for (int a = 0; a < 2; a++) f.reach_m[a] = k->core_half_m[a] + half_m[1];
    }
    const size_t n = n_segment_of(&f, half_m, length_m, nominal_m);
    status s = reserve(w, n + 1, err);
    for (size_t i = 0; i <= n && s == STATUS_OK; i++) {
        struct film_node *node = &w->film.node[w->film.n++];
        const double at = (double)i / (double)n, step = 0.5 / (double)n;
        double normal[3], before[3], after[3];
        film_at(&f, at, node->p, normal);
        film_at(&f, at - step, before, NULL);
        film_at(&f, at + step, after, NULL);
        for (int a = 0; a < 3; a++) after[a] -= before[a];
        for (int a = 0; a < 3; a++)
            node->axis[a] =
                (float)((after[(a + 1) % 3] * normal[(a + 2) % 3] - after[(a + 2) % 3] * normal[(a + 1) % 3]) /
                        (um * um));
        for (int a = 0; a < 2; a++) node->half_m[a] = (float)half_m[a];
        node->step_m = (float)(length_m / (double)n);
        node->group = (uint8_t)cloth_film_group(w->d, kind);
        node->is_first = i == 0;
        node->axis_class = path->axis_class;
    }
    return s;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* A disc about a middle with a normal, as sections across x. */
static void add_disc(struct cloth_work *w, const double middle[3], const double normal[3])
{
    const struct cloth_sequins *q = &w->d->sequins;
    const double radius_m = 0.5 * um * q->diameter_um, h = hypot(normal[0], normal[2]),
                 along[3] = {normal[2] / h, 0.0, -normal[0] / h}; /* in the plane of the disc and of x and z */
    double across[3];
    cross(normal, along, across);
    for (int i = 0; i <= NODES_PER_DISC; i++) {
        struct film_node *node = &w->film.node[w->film.n++];
        /* the ends are half a step from the rim, where the width would vanish */
        const double turn = M_PI * ((double)i + 0.25) / (NODES_PER_DISC + 0.5), x = -radius_m * cos(turn);
        for (int a = 0; a < 3; a++) {
            node->p[a] = middle[a] + x * along[a];
            node->axis[a] = (float)across[a];
        }
        node->half_m[0] = (float)(radius_m * sin(turn));
        node->half_m[1] = (float)fmin(0.5 * um * q->thickness_um, radius_m * sin(turn));
        node->group = (uint8_t)cloth_film_group(w->d, w->d->n_kind);
        node->is_first = i == 0;
        node->axis_class = 0;
    }
}

static size_t n_step(double edge_m, double spacing_um)
{
    const double n = round(edge_m / (um * spacing_um));
    return n > 1.0 ? (size_t)n : 1;
}

status cloth_film_sequins(struct cloth_work *w, double top_m, struct error *err)
{
    const struct cloth_sequins *q = &w->d->sequins;
    const struct rng_key key = {.seed = w->d->seed, .iteration = STREAM_FILM};
    const double *tile_m = w->set.tile_m, tilt = RAD_PER_DEG * q->tilt_deg, spread = RAD_PER_DEG * q->tilt_spread_deg;
    size_t n[2] = {n_step(tile_m[0], q->spacing_um), n_step(tile_m[1], q->row_spacing_um)};
    if (n[1] > 1) n[1] += n[1] % 2; /* rows are moved by turns */
    /* Towards this azimuth a row rises by 2.75 times as much as a step in it: then no step from a disc to a neighbour,
     * of whole or half columns, lies in the planes of the discs. */
    const double towards = atan2(2.75 * tile_m[0] / (double)n[0], tile_m[1] / (double)n[1]);
    status s = reserve(w, n[0] * n[1] * (NODES_PER_DISC + 1), err);
    for (size_t k = 0; k < n[0] * n[1] && s == STATUS_OK; k++) {
        const size_t row = k / n[0], column = k % n[0];
        struct rng rng;
        double z[2];
        rng_start(&rng, &key, (uint32_t)k, 1);
        rng_normal_pair(&rng, z);
        double lean[2] = {tan(tilt) * cos(towards) + spread * z[0], tan(tilt) * sin(towards) + spread * z[1]};
        const double length = sqrt(1.0 + lean[0] * lean[0] + lean[1] * lean[1]),
                     normal[3] = {lean[0] / length, lean[1] / length, 1.0 / length},
                     up_m = um * q->thickness_um + 0.5 * um * q->diameter_um * hypot(lean[0], lean[1]) / length,
                     middle[3] = {tile_m[0] * ((double)column + 0.5 * (double)(row % 2)) / (double)n[0],
                                  tile_m[1] * ((double)row + 0.5) / (double)n[1], top_m + up_m};
        add_disc(w, middle, normal);
    }
    return s;
}

void cloth_film_range(const struct cloth_work *w, double *low_m, double *high_m)
{
    for (size_t i = 0; i < w->film.n; i++) {
        const struct film_node *x = &w->film.node[i];
        const double length =
                         sqrt((double)(x->axis[0] * x->axis[0] + x->axis[1] * x->axis[1] + x->axis[2] * x->axis[2])),
                     up = fabs((double)x->axis[2]) / length, flat = sqrt(fmax(0.0, 1.0 - up * up)),
                     reach_m = hypot((double)x->half_m[0] * up, (double)x->half_m[1] * flat);
        *low_m = fmin(*low_m, x->p[2] - reach_m);
        *high_m = fmax(*high_m, x->p[2] + reach_m);
    }
}

/* Copies the fibers of f into `to`, which has room for them. */
static void copy_fibers(const struct fiber_set *f, struct fiber_set *to)
{
    memcpy(to->first_vertex, f->first_vertex, f->n_fiber * sizeof *f->first_vertex);
    memcpy(to->position_m, f->position_m, 3 * f->n_vertex * sizeof *f->position_m);
    memcpy(to->radius_m, f->radius_m, f->n_fiber * sizeof *f->radius_m);
    memcpy(to->axis_class, f->axis_class, f->n_fiber * sizeof *f->axis_class);
    memcpy(to->group, f->group, f->n_fiber * sizeof *f->group);
}

/* Places and sections of the films, after n_vertex vertices of n_fiber fibers. */
static void append_nodes(const struct cloth_work *w, double shift_m, size_t n_vertex, size_t n_fiber,
                         struct fiber_set *f, struct strand_section *section)
{
    for (size_t i = 0; i < w->film.n; i++, n_vertex++) {
        const struct film_node *x = &w->film.node[i];
        if (x->is_first) {
            f->first_vertex[n_fiber] = n_vertex;
            f->axis_class[n_fiber] = x->axis_class;
            f->radius_m[n_fiber] = 0.0f;
            f->group[n_fiber++] = x->group;
        }
        for (int a = 0; a < 3; a++) {
            f->position_m[3 * n_vertex + (size_t)a] = (float)(x->p[a] + (a == 2 ? shift_m : 0.0));
            section[n_vertex].axis[a] = x->axis[a];
        }
        section[n_vertex].ratio = x->half_m[0] / x->half_m[1];
    }
    f->first_vertex[n_fiber] = n_vertex;
}

/* Radii of discs of equal area, and their means, of the films from fiber `from`. */
static void set_radii(const struct cloth_work *w, size_t from, struct fiber_set *f)
{
    const struct film_node *x = w->film.node;
    for (size_t i = from; i < f->n_fiber; i++) {
        const size_t first = f->first_vertex[i], last = f->first_vertex[i + 1];
        double sum = 0.0;
        for (size_t k = first; k < last; k++, x++) {
            f->shape[k].radius = sqrtf(x->half_m[0] * x->half_m[1]);
            sum += (double)f->shape[k].radius;
        }
        f->radius_m[i] = (float)(sum / (double)(last - first));
    }
}

status cloth_film_append(const struct cloth_work *w, double shift_m, struct fiber_set *f, struct error *err)
{
    struct fiber_set all;
    size_t n_chain = 0;
    for (size_t i = 0; i < w->film.n; i++) n_chain += w->film.node[i].is_first;
    if (n_chain == 0) return STATUS_OK;
    const size_t n_vertex = f->n_vertex, n_fiber = f->n_fiber;
    struct strand_section *section = calloc(n_vertex + w->film.n, sizeof *section); /* ratio 0: as it is */
    fiber_set_init(&all);
    status s = section != NULL ? fiber_set_reserve(&all, n_fiber + n_chain, n_vertex + w->film.n, err)
                               : error_set(err, STATUS_NO_MEMORY, "cannot make the films: out of memory");
    if (s == STATUS_OK) {
        if (n_fiber > 0) copy_fibers(f, &all);
        for (int a = 0; a < 2; a++) all.tile_size_m[a] = w->set.tile_m[a];
        append_nodes(w, shift_m, n_vertex, n_fiber, &all, section);
        s = fiber_set_add_shapes(&all, err);
    }
    if (s == STATUS_OK) {
        if (f->shape != NULL) memcpy(all.shape, f->shape, n_vertex * sizeof *f->shape);
        set_radii(w, n_fiber, &all);
        s = strand_set_sections(section, &all, err);
    }
    free(section);
    fiber_set_release(s == STATUS_OK ? f : &all);
    if (s == STATUS_OK) *f = all;
    return s;
}
