#include "optimizer/fit/cloth/cloth_estimator.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Share of the range by which a number moves for its derivative. The noise of a difference falls with its width, but a
 * wide one is off by the square of the width: optimizer/fit/NOTES.md has figures of both. */
static const double difference_share = 0.15;

status cloth_estimator_init(struct cloth_estimator *e, const struct cloth_source *source, size_t n_scattering,
                            size_t n_configuration, const struct param_info *info,
                            const struct fit_parameter *parameter, struct error *err)
{
    *e = (struct cloth_estimator){.source = *source,
                                  .n_scattering = n_scattering,
                                  .n_configuration = n_configuration,
                                  .number_derivatives = true,
                                  .difference = difference_share};
    if (source->n_number > CLOTH_MAX_FITTED)
        return error_set(err, STATUS_INVALID, "cannot fit %zu numbers of a cloth: at most %d are allowed",
                         source->n_number, CLOTH_MAX_FITTED);
    for (size_t k = 0; k < source->n_number; k++) {
        coordinate_init(&e->coordinate[k], &info[k], parameter[k].lower, parameter[k].upper);
        e->fixed[k] = parameter[k].fixed;
    }
    e->moved = calloc(n_configuration > 0 ? n_configuration : 1, sizeof *e->moved);
    e->n_path = calloc(n_configuration > 0 ? n_configuration : 1, sizeof *e->n_path);
    return e->moved != NULL && e->n_path != NULL
               ? STATUS_OK
               : error_set(err, STATUS_NO_MEMORY, "cannot fit a cloth: out of memory");
}

void cloth_estimator_release(struct cloth_estimator *e)
{
    free(e->moved);
    free(e->n_path);
    e->moved = NULL;
    e->n_path = NULL;
}

/* Spreads the derivatives of the scattering model to their columns of the wider matrix, in place. */
static void widen(size_t n_scattering, size_t n_number, double *matrix)
{
    size_t wide = n_scattering + n_number;
    for (size_t c = 3; c-- > 0;) {
        memmove(matrix + c * wide, matrix + c * n_scattering, n_scattering * sizeof *matrix);
        memset(matrix + c * wide + n_scattering, 0, n_number * sizeof *matrix);
    }
}

/* ---- one number after the other ---- */

/* Moves number k to the side of the iteration, or to the other one where the bound is too near. Returns the distance in
 * the fit coordinate with its sign; 0 where the bounds leave no room. */
static double move_number(const struct cloth_estimator *e, size_t k, uint32_t iteration, double *number)
{
    const struct coordinate *c = &e->coordinate[k];
    double x = coordinate_from_param(c, number[k]), width = e->difference * (c->upper - c->lower);
    double side = iteration % 2 == 1 ? -1.0 : 1.0, to = x + side * width;
    if (to > c->upper || to < c->lower) to = x - side * width;
    to = fmin(fmax(to, c->lower), c->upper);
    number[k] = coordinate_to_param(c, to);
    return coordinate_from_param(c, number[k]) - x;
}

/* Column k: the difference of the moved cloth's means from `out`, over `distance`, by the number's internal unit. */
static void fill_column(const struct cloth_estimator *e, size_t k, double slope, double distance, struct estimate *out)
{
    size_t n = e->n_scattering + e->source.n_number;
    double factor = 1.0 / (distance * slope);
    for (size_t i = 0; i < e->n_configuration; i++) {
        if (out[i].n_path == 0 || e->moved[i].n_path == 0) continue;
        for (size_t c = 0; c < 3; c++) {
            size_t at = c * n + e->n_scattering + k;
            out[i].jac[at] = (e->moved[i].mean[c] - out[i].mean[c]) * factor;
            out[i].jac_var[at] = (e->moved[i].var[c] + out[i].var[c]) * factor * factor;
        }
        out[i].n_bounce += e->moved[i].n_bounce;
    }
}

static status add_single(const struct cloth_estimator *e, size_t k, const struct estimator_call *call,
                         const struct progress *progress, struct estimate *out, double *seconds, struct error *err)
{
    double number[CLOTH_MAX_FITTED];
    memcpy(number, call->param + e->n_scattering, e->source.n_number * sizeof *number);
    double slope = coordinate_slope(&e->coordinate[k], number[k]);
    double distance = move_number(e, k, call->iteration, number);
    if (distance == 0.0) return STATUS_OK;
    struct estimator_call moved = *call;
    moved.want_jacobian = false;
    status s = e->source.estimate(e->source.context, number, &moved, progress, e->moved, seconds, err);
    if (s == STATUS_OK) fill_column(e, k, slope, distance, out);
    return s;
}

/* ---- all numbers at once ---- */

/* Whether i is a square modulo the prime q, or 0. */
static bool is_square(size_t i, size_t q)
{
    for (size_t r = 0; r < q; r++)
        if (r * r % q == i % q) return true;
    return false;
}

/* Sign of column j in row i of the design of q + 1 rows: the shifted quadratic residues, and a last row of -1. Columns
 * are orthogonal, and each has as many +1 as -1. */
static double design_sign(size_t i, size_t j, size_t q) { return i < q && is_square(i + j, q) ? 1.0 : -1.0; }

size_t cloth_estimator_n_moved(enum cloth_moves moves, size_t n_free)
{
    static const size_t prime[] = {3, 7, 11, 19, 23, 31, 43}; /* 3 modulo 4 */
    size_t i = 0;
    if (n_free == 0 || moves == CLOTH_MOVES_SINGLE) return n_free;
    while (prime[i] < n_free) i++;
    return prime[i] + 1;
}

double cloth_estimator_cost(enum cloth_moves moves, size_t n_free)
{
    return 1.0 + (moves == CLOTH_MOVES_SINGLE ? (double)n_free : n_free > 0 ? 1.0 : 0.0);
}

static size_t free_numbers(const struct cloth_estimator *e)
{
    size_t n = 0;
    for (size_t k = 0; k < e->source.n_number; k++) n += !e->fixed[k];
    return n;
}

/* The numbers of one moved cloth, and the factor of its means in each column. */
struct move {
    double number[CLOTH_MAX_FITTED], factor[CLOTH_MAX_FITTED];
};

static void make_move(const struct cloth_estimator *e, size_t i_cloth, size_t n_moved,
                      const struct estimator_call *call, struct move *out)
{
    memset(out, 0, sizeof *out);
    memcpy(out->number, call->param + e->n_scattering, e->source.n_number * sizeof *out->number);
    for (size_t k = 0, j = 0; k < e->source.n_number; k++) {
        if (e->fixed[k]) continue;
        const struct coordinate *c = &e->coordinate[k];
        double x = coordinate_from_param(c, out->number[k]), width = e->difference * (c->upper - c->lower);
        double sign = (call->iteration % 2 == 1 ? -1.0 : 1.0) * design_sign(i_cloth, j++, n_moved - 1);
        double low = fmax(c->lower, x - width), high = fmin(c->upper, x + width);
        double slope = coordinate_slope(c, out->number[k]);
        if (!(high > low)) continue;
        out->number[k] = coordinate_to_param(c, sign > 0.0 ? high : low);
        out->factor[k] = 2.0 * sign / ((double)n_moved * (high - low) * slope);
    }
}

static void add_move(const struct cloth_estimator *e, const struct move *move, struct estimate *out)
{
    size_t n = e->n_scattering + e->source.n_number;
    for (size_t i = 0; i < e->n_configuration; i++) {
        if (out[i].n_path == 0 || e->moved[i].n_path == 0) continue;
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < e->source.n_number; k++) {
                size_t at = c * n + e->n_scattering + k;
                out[i].jac[at] += e->moved[i].mean[c] * move->factor[k];
                out[i].jac_var[at] += e->moved[i].var[c] * move->factor[k] * move->factor[k];
            }
        out[i].n_bounce += e->moved[i].n_bounce;
    }
}

/* Divides the path budget of each configuration evenly among the moved cloths, rounded down to whole blocks (at least
 * one). */
static void share_paths(const struct cloth_estimator *e, size_t n_moved, const struct estimator_call *call)
{
    for (size_t i = 0; i < e->n_configuration; i++) {
        size_t n_block = call->n_path[i] / (n_moved * RADIANCE_BLOCK_PATHS);
        e->n_path[i] = call->n_path[i] == 0 ? 0 : RADIANCE_BLOCK_PATHS * (n_block > 0 ? n_block : 1);
    }
}

static status add_balanced(const struct cloth_estimator *e, size_t i_cloth, const struct estimator_call *call,
                           const struct progress *progress, struct estimate *out, double *seconds, struct error *err)
{
    const size_t n_moved = cloth_estimator_n_moved(e->moves, free_numbers(e));
    struct estimator_call moved = *call;
    struct move move;
    make_move(e, i_cloth, n_moved, call, &move);
    share_paths(e, n_moved, call);
    moved.n_path = e->n_path;
    moved.want_jacobian = false;
    status s = e->source.estimate(e->source.context, move.number, &moved, progress, e->moved, seconds, err);
    if (s == STATUS_OK) add_move(e, &move, out);
    return s;
}

/* ---- the estimator ---- */

static status add_columns(const struct cloth_estimator *e, const struct estimator_call *call,
                          const struct progress *progress, struct estimate *out, double *wall_s, struct error *err)
{
    const bool single = e->moves == CLOTH_MOVES_SINGLE;
    const size_t m = free_numbers(e), n_moved = cloth_estimator_n_moved(e->moves, m);
    const size_t n = single ? e->source.n_number : n_moved;
    const double first = 1.0 / cloth_estimator_cost(e->moves, m), share = (1.0 - first) / (double)n_moved;
    double done = 0.0;
    status s = STATUS_OK;
    for (size_t i = 0; i < n && s == STATUS_OK; i++) {
        struct progress_part part;
        double seconds = 0.0;
        if (single && e->fixed[i]) continue;
        struct progress next = progress_begin_part(&part, progress, first + share * done, share);
        s = (single ? add_single : add_balanced)(e, i, call, &next, out, &seconds, err);
        *wall_s += seconds;
        done += 1.0;
    }
    return s;
}

static status run(void *context, const struct estimator_call *call, const struct progress *progress,
                  struct estimate *out, double *wall_s, struct error *err)
{
    const struct cloth_estimator *e = context;
    const bool differ = call->want_jacobian && e->number_derivatives && free_numbers(e) > 0;
    const double share = differ ? 1.0 / cloth_estimator_cost(e->moves, free_numbers(e)) : 1.0;
    struct progress_part part;
    struct progress first = progress_begin_part(&part, progress, 0.0, share);
    struct estimator_call alone = *call;
    alone.pair = NULL; /* moved cloths come between the replicas */
    call = &alone;
    status s = e->source.estimate(e->source.context, call->param + e->n_scattering, call, &first, out, wall_s, err);
    for (size_t i = 0; i < e->n_configuration && s == STATUS_OK; i++) {
        widen(e->n_scattering, e->source.n_number, out[i].jac);
        widen(e->n_scattering, e->source.n_number, out[i].jac_var);
    }
    return s == STATUS_OK && differ ? add_columns(e, call, progress, out, wall_s, err) : s;
}

struct estimator cloth_estimator(struct cloth_estimator *e)
{
    return (struct estimator){.context = e,
                              .n_configuration = e->n_configuration,
                              .n_param = e->n_scattering + e->source.n_number,
                              .run = run};
}
