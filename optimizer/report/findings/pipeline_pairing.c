#include "optimizer/fit/objective/objective.h"
#include "optimizer/report/findings/findings.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <math.h>
#include <stdlib.h>

/* Another order must leave at most this share of the error, and the error as given must be at least this: below it the
 * order of the rows cannot be told. */
static const double better_share = 0.5, least_error = 0.05;
static const double same_rad = 1e-6;

static bool same_view(const struct configuration *a, const struct configuration *b)
{
    return fabs(a->light_theta_rad - b->light_theta_rad) < same_rad &&
           fabs(a->light_phi_rad - b->light_phi_rad) < same_rad &&
           fabs(a->camera_theta_rad - b->camera_theta_rad) < same_rad &&
           fabs(a->camera_phi_rad - b->camera_phi_rad) < same_rad && a->n_rotation <= 1 && b->n_rotation <= 1;
}

static bool counts(const struct observation *o) { return o->weight > 0.0 && !observation_is_contrast(o); }

/* Index of row i among the rows of its lamp and camera in the order of rotation, and their number. */
static size_t rotation_index(const struct observation_set *o, size_t i, size_t *n)
{
    size_t place = 0;
    *n = 0;
    for (size_t j = 0; j < o->n; j++) {
        const struct observation *other = &o->item[j];
        if (!counts(other) || !same_view(&other->configuration, &o->item[i].configuration)) continue;
        double turn = other->configuration.cloth_rotation_rad, own = o->item[i].configuration.cloth_rotation_rad;
        ++*n;
        place += turn < own || (!(turn > own) && j < i);
    }
    return place;
}

/* The compared quantity: the brightness of a row, as measured and as rendered. */
struct brightness {
    size_t place, n; /* in the group of the row's lamp and camera */
    double measured, rendered;
};

static double mean_of(const double rgb[3]) { return (rgb[0] + rgb[1] + rgb[2]) / 3.0; }

static void look_at_row(const struct report *report, size_t i, struct brightness *b)
{
    const struct pipeline_model *m = &report->model[report_best_model(report)];
    struct estimate x, y;
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[0][i], &x);
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[1][i], &y);
    b->place = rotation_index(&report->in.job->rows->observation, i, &b->n);
    b->measured = mean_of(report->in.job->rows->observation.item[i].mean_rgb);
    b->rendered = 0.5 * (mean_of(x.mean) + mean_of(y.mean));
}

static bool same_group(const struct report *report, size_t i, size_t j)
{
    return counts(&report->in.job->rows->observation.item[j]) &&
           same_view(&report->in.job->rows->observation.item[i].configuration,
                     &report->in.job->rows->observation.item[j].configuration);
}

/* Means over the group of row i, at least OBJECTIVE_TAU. */
static void group_mean(const struct report *report, const struct brightness *b, size_t i, double *measured,
                       double *rendered)
{
    *measured = *rendered = 0.0;
    for (size_t j = 0; j < report->in.job->rows->observation.n; j++) {
        if (!same_group(report, i, j)) continue;
        *measured += b[j].measured / (double)b[i].n;
        *rendered += b[j].rendered / (double)b[i].n;
    }
    *measured = fmax(*measured, OBJECTIVE_TAU);
    *rendered = fmax(*rendered, OBJECTIVE_TAU);
}

/* Row at a place of the group of row i. */
static size_t row_at(const struct report *report, const struct brightness *b, size_t i, size_t place)
{
    for (size_t j = 0; j < report->in.job->rows->observation.n; j++)
        if (same_group(report, i, j) && b[j].place == place) return j;
    return i;
}

/* Returns the difference between measured and rendered brightness, each over the mean of its group, as a root mean
 * square over groups of at least two rows, with each rendering beside the measurement at place n - 1 - k (reverse) or k
 * + shift of its group. Levels of groups are left out, because the fit may have adapted to them. NaN without such
 * groups. */
static double contrast_error(const struct report *report, const struct brightness *b, bool reverse, size_t shift)
{
    double sum = 0.0, count = 0.0, measured, rendered;
    for (size_t i = 0; i < report->in.job->rows->observation.n; i++) {
        if (!counts(&report->in.job->rows->observation.item[i]) || b[i].n < 2) continue;
        size_t j = row_at(report, b, i, reverse ? b[i].n - 1 - b[i].place : (b[i].place + shift) % b[i].n);
        group_mean(report, b, i, &measured, &rendered);
        double error = b[j].measured / measured - b[i].rendered / rendered;
        sum += error * error;
        count += 1.0;
    }
    return count > 0.0 ? sqrt(sum / count) : NAN;
}

status pipeline_warn_pairing(struct report *report, struct error *err)
{
    struct brightness *b = calloc(report->in.job->rows->observation.n + 1, sizeof *b);
    size_t largest = 2;
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot compare the order of rows: out of memory");
    for (size_t i = 0; i < report->in.job->rows->observation.n; i++) {
        look_at_row(report, i, &b[i]);
        largest = b[i].n > largest ? b[i].n : largest;
    }
    const double given = contrast_error(report, b, false, 0);
    double best = INFINITY;
    if (given >= least_error)
        best = fmin(contrast_error(report, b, true, 0),
                    fmin(contrast_error(report, b, false, 1), contrast_error(report, b, false, largest - 1)));
    if (best <= better_share * given)
        worker_status_warn(report->in.job->tools->status,
                           "between rows of one lamp and camera the fit is off by %.3g %% as given, and by %.3g %% in "
                           "another order of the cloth's rotations: are rotations or files exchanged?",
                           100.0 * given, 100.0 * best);
    free(b);
    return STATUS_OK;
}
