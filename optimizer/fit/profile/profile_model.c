#include "optimizer/fit/profile/profile_model.h"

#include <math.h>
#include <string.h>

/* Lobes of 2 degrees are 64 places of the width wide; more change profiles of the published fibers by less than 1e-3.
 * A flat section has smoother tables. */
enum { NEAR_VIEWS = 128, TURN_VIEWS = 48, ROWS_OF_TASK = 32 };

struct prediction {
    const struct scattering_model *model;
    const struct scattering_state *state;
    const struct fiber_profile *profile;
    size_t n_view;
    double *value, *jac;
};

static void set_direction(double theta_rad, double phi_rad, float out[3])
{
    out[0] = (float)sin(theta_rad);
    out[1] = (float)(cos(theta_rad) * cos(phi_rad));
    out[2] = (float)(cos(theta_rad) * sin(phi_rad));
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
        const double azimuth = scattering_view_azimuth_rad(d->model, (int)k, (int)d->n_view);
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
    for (size_t i = i_task * ROWS_OF_TASK; i < (i_task + 1) * ROWS_OF_TASK && i < d->profile->n; i++) predict_row(d, i);
}

status profile_model_predict(const struct scattering_model *model, const double *param,
                             const struct fiber_profile *profile, const struct profile_work *work, double *value,
                             double *jac, struct error *err)
{
    const struct progress silent = progress_silent(work->progress);
    struct scattering_state *state = NULL;
    status s = scattering_prepare(model, param, work->pool, &state, err);
    if (s != STATUS_OK) return s;
    struct prediction d = {.model = model,
                           .state = state,
                           .profile = profile,
                           .n_view = model->near_field     ? NEAR_VIEWS
                                     : model->flat_section ? TURN_VIEWS
                                                           : 1,
                           .value = value,
                           .jac = jac};
    s = thread_pool_run(work->pool, (profile->n + ROWS_OF_TASK - 1) / ROWS_OF_TASK, predict_rows, &d, &silent);
    model->release(state);
    return s == STATUS_OK ? s : error_set(err, s, "cancelled");
}
