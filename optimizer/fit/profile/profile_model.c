#include "optimizer/fit/profile/profile_model.h"

#include <math.h>
#include <string.h>

/* Lobes of 2 degrees are 64 places of the width wide; more change profiles of the published fibers by less than 1e-3.
 * A flat section has smoother tables. */
enum { NEAR_VIEWS = 128, TURN_VIEWS = 48, ROWS_OF_TASK = 32 };
/* Half the distance of the difference by the turn. Lobes are at least 3.5 degrees wide, so it misses the derivative by
 * at most (0.5 / 3.5)^2 / 2 = 1 % of its largest value. */
static const double turn_step_rad = 0.5 * M_PI / 180.0;

struct prediction {
    const struct scattering_model *model;
    struct scattering_state *state;
    const struct fiber_profile *profile;
    size_t n_view;
    bool turns;
    double turn_rad;
    double *value, *jac, *by_turn;
};

static void set_direction(double theta_rad, double phi_rad, float out[3])
{
    out[0] = (float)sin(theta_rad);
    out[1] = (float)(cos(theta_rad) * cos(phi_rad));
    out[2] = (float)(cos(theta_rad) * sin(phi_rad));
}

bool profile_model_turns(const struct scattering_model *model, const struct fiber_profile *profile)
{
    return profile->has_phi_i && model->flat_section;
}

/* The azimuth of view k of a row in the fiber frame. */
static double view_azimuth(const struct prediction *d, const struct profile_row *row, size_t k)
{
    if (d->turns) return row->phi_i_rad + row->phi_rad - d->turn_rad;
    return scattering_view_azimuth_rad(d->model, (int)k, (int)d->n_view);
}

/* Derivatives of a row by the turn. */
static void predict_by_turn(const struct prediction *d, size_t i)
{
    const struct profile_row *row = &d->profile->row[i];
    const size_t n_channel = d->profile->n_channel;
    double *by_turn = d->by_turn + i * n_channel;
    float s_rgb[3], wi[3], wo[3];
    memset(by_turn, 0, n_channel * sizeof *by_turn);
    for (int side = -1; side <= 1 && d->turns; side += 2) {
        const double azimuth = view_azimuth(d, row, 0) - side * turn_step_rad;
        set_direction(row->theta_o_rad, azimuth, wo);
        set_direction(row->theta_i_rad, azimuth - row->phi_rad, wi);
        d->model->eval(d->state, wi, wo, s_rgb, NULL);
        const double width = d->model->width != NULL ? (double)d->model->width(d->state, wi, NULL) : 1;
        for (size_t c = 0; c < n_channel; c++)
            by_turn[c] += side * cos(row->theta_i_rad) * width * (double)s_rgb[c] / (2.0 * turn_step_rad);
    }
}

static void predict_row(const struct prediction *d, size_t i)
{
    const struct profile_row *row = &d->profile->row[i];
    const size_t n = d->model->n_param, n_channel = d->profile->n_channel;
    double *value = d->value + i * n_channel, *jac = d->jac != NULL ? d->jac + i * n_channel * n : NULL;
    float s_rgb[3], score[3 * SCATTERING_MAX_FLAT], by[SCATTERING_MAX_PARAM] = {0}, wi[3], wo[3];
    memset(value, 0, n_channel * sizeof *value);
    if (jac != NULL) memset(jac, 0, n_channel * n * sizeof *jac);
    for (size_t k = 0; k < d->n_view; k++) {
        const double azimuth = view_azimuth(d, row, k);
        set_direction(row->theta_o_rad, azimuth, wo);
        set_direction(row->theta_i_rad, azimuth - row->phi_rad, wi);
        d->model->eval(d->state, wi, wo, s_rgb, jac != NULL ? score : NULL);
        const double width = d->model->width != NULL ? (double)d->model->width(d->state, wi, by) : 1,
                     share = cos(row->theta_i_rad) * width / (double)d->n_view;
        for (size_t c = 0; c < n_channel; c++) {
            const double part = share * (double)s_rgb[c];
            value[c] += part;
            for (size_t p = 0; p < n && jac != NULL; p++) jac[c * n + p] += part * (double)(score[c * n + p] + by[p]);
        }
    }
}

static void predict_rows(void *context, size_t i_task, size_t i_thread)
{
    const struct prediction *d = context;
    (void)i_thread;
    for (size_t i = i_task * ROWS_OF_TASK; i < (i_task + 1) * ROWS_OF_TASK && i < d->profile->n; i++) {
        predict_row(d, i);
        if (d->by_turn != NULL) predict_by_turn(d, i);
    }
}

/* Prepares the model, with one mode alone where the work asks for it; the caller releases d->state. */
static status begin(struct prediction *d, const struct scattering_model *model, const double *param,
                    const struct profile_work *work, struct error *err)
{
    d->model = model;
    status s = scattering_prepare(model, param, work->pool, &d->state, err);
    if (s == STATUS_OK && work->mode > 0) model->keep_mode(d->state, work->mode - 1);
    return s;
}

static status predict_all(struct prediction *d, const struct profile_work *work, struct error *err)
{
    const struct progress silent = progress_silent(work->progress);
    d->turns = profile_model_turns(d->model, d->profile);
    d->n_view = d->model->near_field ? NEAR_VIEWS : d->model->flat_section && !d->turns ? TURN_VIEWS : 1;
    status s = thread_pool_run(work->pool, (d->profile->n + ROWS_OF_TASK - 1) / ROWS_OF_TASK, predict_rows, d, &silent);
    return s == STATUS_OK ? s : error_set(err, s, "cancelled");
}

status profile_model_predict(const struct scattering_model *model, const double *param,
                             const struct fiber_profile *profile, const struct profile_work *work, double *value,
                             double *jac, struct error *err)
{
    struct prediction d = {
        .profile = profile, .turn_rad = work->turn_rad, .value = value, .jac = jac, .by_turn = work->by_turn};
    status s = begin(&d, model, param, work, err);
    if (s != STATUS_OK) return s;
    s = predict_all(&d, work, err);
    model->release(d.state);
    return s;
}

status profile_model_scan(const struct scattering_model *model, const double *param,
                          const struct fiber_profile *profile, const struct profile_work *work,
                          const struct profile_scan *scan, struct error *err)
{
    struct prediction d = {.profile = profile, .value = scan->value};
    status s = begin(&d, model, param, work, err);
    if (s != STATUS_OK) return s;
    for (size_t k = 0; k < scan->n && s == STATUS_OK; k++) {
        d.turn_rad = M_PI * (double)k / (double)scan->n;
        s = predict_all(&d, work, err);
        if (s == STATUS_OK) scan->found(scan->context, k, scan->value);
    }
    model->release(d.state);
    return s;
}
