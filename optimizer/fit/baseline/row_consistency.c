#include "optimizer/fit/baseline/row_consistency.h"
#include "base/angle.h"
#include "base/option_id.h"
#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/job/checks/job_consistency.h"

#include <math.h>
#include <stdlib.h>

enum { LEAST_ROWS = 6, LEAST_LONG = 16, PLAIN_NUMBERS = 12 };

/* Largest share of the plain BRDF's error that another reading of the rows may leave to be better, and the error
 * from which there is something to explain. */
static const double better_share = 0.5, least_error = 0.1;
/* Normal deviates by which the errors of the two readings must differ. Channels are alike, so it is more than usual. */
static const double least_deviates = 4.0;
/* Below this cosine of the lamp the lamp's own size matters. */
static const double least_cos = 0.05;

status row_consistency_check_angles(const struct observation_set *o, const char *field, struct error *err)
{
    struct angle_span span = {0};
    for (size_t i = 0; i < o->n; i++) {
        const struct configuration *c = &o->item[i].configuration;
        angle_span_add(&span, c->light_theta_rad * DEG_PER_RAD, c->light_phi_rad * DEG_PER_RAD,
                       c->camera_theta_rad * DEG_PER_RAD, c->camera_phi_rad * DEG_PER_RAD,
                       c->cloth_rotation_rad * DEG_PER_RAD);
    }
    if (!angle_span_in_radians(&span)) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, field,
                           "the angles look like radians: the largest one from the normal is %.3g; write degrees",
                           span.theta);
}

static bool judged(const struct observation *o)
{
    const double *around = o->configuration.environment_rgb;
    bool dark = o->configuration.environment == NULL && !(around[0] > 0.0 || around[1] > 0.0 || around[2] > 0.0);
    return dark && o->weight > 0.0 && !observation_is_contrast(o) && o->configuration.light_theta_rad < M_PI_2;
}

static double incident(const struct observation *o) { return fmax(cos(o->configuration.light_theta_rad), least_cos); }

static int compare_double(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Median over the judged rows of brightness per incident light; NaN without such rows. */
static status median_reflected(const struct observation_set *rows, double *median, struct error *err)
{
    double *v = malloc((rows->n + 1) * sizeof *v);
    if (v == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot check the measurements: out of memory");
    for (size_t i = 0; i < rows->n; i++) {
        const struct observation *o = &rows->item[i];
        v[i] = (o->mean_rgb[0] + o->mean_rgb[1] + o->mean_rgb[2]) / (3.0 * incident(o));
    }
    qsort(v, rows->n, sizeof *v, compare_double);
    *median = rows->n > 0 ? v[rows->n / 2] : NAN;
    free(v);
    return STATUS_OK;
}

static void warn_scale(double median, const struct warning_sink *warn)
{
    if (median < ROW_CONSISTENCY_DARK)
        warning_send(warn, OPTION_NONE,
                     "all rows are dark: half of them are below %.2g of what a white cloth shows under the same lamp; "
                     "is the scale right? A white diffuser that faces the lamp has the radiance 1",
                     median);
    if (median > ROW_CONSISTENCY_WHITE)
        warning_send(warn, OPTION_NONE,
                     "all rows are above white: half of them are above %.3g times what a white cloth shows under the "
                     "same lamp; is the scale right? A white diffuser that faces the lamp has the radiance 1",
                     median);
}

/* The error of the plain BRDF that is fitted to the rows, each read in another way. reread: NULL for none. */
static status plain_error(const struct observation_set *rows, void (*reread)(struct observation *o), double *error,
                          struct error *err)
{
    struct observation_set other;
    struct plain_brdf brdf;
    observation_set_init(&other);
    status s = STATUS_OK;
    for (size_t i = 0; i < rows->n && s == STATUS_OK; i++) {
        struct observation row = rows->item[i];
        row.set = JOB_SET_FIT;
        if (reread != NULL) reread(&row);
        s = observation_set_append(&other, &row, err);
    }
    if (s == STATUS_OK) s = plain_brdf_fit(&other, &brdf, err);
    if (s == STATUS_OK) *error = plain_brdf_rel_rms(&brdf, &other, JOB_SET_FIT);
    observation_set_release(&other);
    return s;
}

/* Returns the share of the error that another reading may leave. The plain BRDF has twelve numbers, so it fits a few
 * rows well whatever they mean. The logarithm of the ratio of two mean squares with d degrees of freedom each has the
 * standard deviation 2 / sqrt(d - 1), nearly (F-test). */
static double largest_share(size_t n_row)
{
    const double freedom = 3.0 * (double)n_row - PLAIN_NUMBERS;
    return fmin(better_share, exp(-least_deviates / sqrt(freedom - 1.0)));
}

/* Makes the radiance of a row whose value is a BRDF. */
static void brdf_to_radiance(struct observation *o)
{
    for (int c = 0; c < 3; c++) o->mean_rgb[c] *= M_PI * incident(o);
}

/* Exchanges lamp and camera. */
static void exchange(struct observation *o)
{
    struct configuration *c = &o->configuration;
    const double theta = c->light_theta_rad, phi = c->light_phi_rad;
    c->light_theta_rad = c->camera_theta_rad;
    c->light_phi_rad = c->camera_phi_rad;
    c->camera_theta_rad = theta;
    c->camera_phi_rad = phi;
}

/* Whether all cameras are in front of the cloth, so that a lamp may stand in their places. */
static bool seen_from_front(const struct observation_set *rows)
{
    for (size_t i = 0; i < rows->n; i++)
        if (!(rows->item[i].configuration.camera_theta_rad < M_PI_2)) return false;
    return true;
}

static void warn_brdf(double as_brdf, double as_given, const struct warning_sink *warn)
{
    warning_send(warn, OPTION_NONE,
                 "the values look like those of a BRDF (1/sr), not like radiances: they do not fall as the lamp comes "
                 "in at grazing angles, and a plain surface fits them to %.2g %% if each is multiplied by pi and the "
                 "cosine of the lamp's angle, and to %.2g %% as they are",
                 100.0 * as_brdf, 100.0 * as_given);
}

static void warn_exchanged(double exchanged, double as_given, const struct warning_sink *warn)
{
    warning_send(warn, OPTION_NONE,
                 "lamp and camera look exchanged: the values fall as the camera, not the lamp, goes to grazing angles, "
                 "and a plain surface fits them to %.2g %% with lamp and camera exchanged, and to %.2g %% as they are",
                 100.0 * exchanged, 100.0 * as_given);
}

/* Warns where another reading explains the rows far better: of two of them, the better one. */
static status warn_readings(const struct observation_set *rows, const struct warning_sink *warn, struct error *err)
{
    double as_given, as_brdf = INFINITY, exchanged = INFINITY;
    status s = plain_error(rows, NULL, &as_given, err);
    if (s == STATUS_OK) s = plain_error(rows, brdf_to_radiance, &as_brdf, err);
    if (s == STATUS_OK && seen_from_front(rows)) s = plain_error(rows, exchange, &exchanged, err);
    if (s != STATUS_OK || as_given < least_error) return s;
    const double most = largest_share(rows->n) * as_given;
    if (exchanged <= most && exchanged < as_brdf)
        warn_exchanged(exchanged, as_given, warn);
    else if (as_brdf <= most)
        warn_brdf(as_brdf, as_given, warn);
    return STATUS_OK;
}

/* Warns of a long table in which the lamp comes from one azimuth of the cloth alone, as in means over all rotations. */
static void warn_one_azimuth(const struct observation_set *rows, const struct warning_sink *warn)
{
    const double same_rad = 0.5 / DEG_PER_RAD;
    const struct configuration *first = &rows->item[0].configuration;
    bool out_of_plane = false;
    for (size_t i = 0; i < rows->n; i++) {
        const struct configuration *c = &rows->item[i].configuration;
        const double turn = c->light_phi_rad - c->cloth_rotation_rad - first->light_phi_rad + first->cloth_rotation_rad;
        const bool lamp_turns = sin(c->light_theta_rad) > 0.05 && fabs(sin(0.5 * turn)) > sin(0.5 * same_rad);
        if (c->n_rotation > 1 || c->cloth_rotation_rad != 0.0 || lamp_turns) return;
        out_of_plane = out_of_plane || fabs(sin(c->camera_phi_rad - c->light_phi_rad)) > 0.05;
    }
    if (rows->n < LEAST_LONG || !out_of_plane) return;
    warning_send(warn, OPTION_NONE,
                 "in all %zu rows the lamp comes from one side of the cloth at rotation 0: if the data are isotropic "
                 "(means over all rotations), write 'all' as cloth_rotation_deg",
                 rows->n);
}

/* Selects the rows that are judged. */
static status select_judged(const struct observation_set *o, struct observation_set *rows, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i < o->n && s == STATUS_OK; i++)
        if (judged(&o->item[i])) s = observation_set_append(rows, &o->item[i], err);
    return s;
}

status row_consistency_warn(const struct observation_set *o, const struct warning_sink *warn, struct error *err)
{
    struct observation_set rows;
    double median = NAN;
    observation_set_init(&rows);
    status s = select_judged(o, &rows, err);
    if (s == STATUS_OK) s = median_reflected(&rows, &median, err);
    if (s == STATUS_OK) warn_scale(median, warn);
    if (s == STATUS_OK && rows.n > 0) warn_one_azimuth(&rows, warn);
    if (s == STATUS_OK && rows.n >= LEAST_ROWS) s = warn_readings(&rows, warn, err);
    observation_set_release(&rows);
    return s;
}
