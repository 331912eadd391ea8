#include "optimizer/fit/cloth/cloth_estimator.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Share of the range by which a number moves for its derivative. Radiance is noisy and bends slowly with the numbers of
 * a cloth, so a wide difference is the better one: its noise falls with the width, and the central difference of a wide
 * one is off by its square only. */
static const double difference_share = 0.25;

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
    return e->moved != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot fit a cloth: out of memory");
}

void cloth_estimator_release(struct cloth_estimator *e)
{
    free(e->moved);
    e->moved = NULL;
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

static status add_column(const struct cloth_estimator *e, size_t k, const struct estimator_call *call,
                         const struct progress *progress, struct estimate *out, double *wall_s, struct error *err)
{
    double number[CLOTH_MAX_FITTED], seconds = 0.0;
    memcpy(number, call->param + e->n_scattering, e->source.n_number * sizeof *number);
    double slope = coordinate_slope(&e->coordinate[k], number[k]);
    double distance = move_number(e, k, call->iteration, number);
    if (distance == 0.0) return STATUS_OK;
    struct estimator_call moved = *call;
    moved.want_jacobian = false;
    status s = e->source.estimate(e->source.context, number, &moved, progress, e->moved, &seconds, err);
    if (s != STATUS_OK) return s;
    fill_column(e, k, slope, distance, out);
    *wall_s += seconds;
    return STATUS_OK;
}

static status run(void *context, const struct estimator_call *call, const struct progress *progress,
                  struct estimate *out, double *wall_s, struct error *err)
{
    const struct cloth_estimator *e = context;
    const size_t m = e->source.n_number;
    const bool differ = call->want_jacobian && e->number_derivatives;
    double n_cloth = 1.0, done = 1.0;
    for (size_t k = 0; k < m && differ; k++) n_cloth += !e->fixed[k];
    struct progress_part part;
    struct progress first = progress_begin_part(&part, progress, 0.0, 1.0 / n_cloth);
    status s = e->source.estimate(e->source.context, call->param + e->n_scattering, call, &first, out, wall_s, err);
    for (size_t i = 0; i < e->n_configuration && s == STATUS_OK; i++) {
        widen(e->n_scattering, m, out[i].jac);
        widen(e->n_scattering, m, out[i].jac_var);
    }
    for (size_t k = 0; k < m && differ && s == STATUS_OK; k++) {
        if (e->fixed[k]) continue;
        struct progress next = progress_begin_part(&part, progress, done / n_cloth, 1.0 / n_cloth);
        s = add_column(e, k, call, &next, out, wall_s, err);
        done += 1.0;
    }
    return s;
}

struct estimator cloth_estimator(struct cloth_estimator *e)
{
    return (struct estimator){.context = e,
                              .n_configuration = e->n_configuration,
                              .n_param = e->n_scattering + e->source.n_number,
                              .run = run};
}
