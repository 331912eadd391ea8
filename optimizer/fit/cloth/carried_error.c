#include "optimizer/fit/cloth/carried_error.h"
#include "base/small_matrix.h"
#include "optimizer/fit/cloth/cloth_estimator.h"

#include <math.h>
#include <string.h>

enum { X = CLOTH_MAX_FITTED };

void carried_error_leave_out(const struct uncertainty *u, size_t first, size_t n_out, struct uncertainty *out)
{
    size_t n = u->n_param, m = n - n_out;
    *out = *u;
    out->n_param = m;
    for (size_t p = 0; p < m; p++) {
        size_t from = p < first ? p : p + n_out;
        out->se_param[p] = u->se_param[from];
        out->at_bound[p] = u->at_bound[from];
        out->determined[p] = u->determined[from];
        for (size_t q = 0; q < m; q++) {
            size_t to = q < first ? q : q + n_out;
            out->cov[p * m + q] = u->cov[from * n + to];
            out->correlation[p * m + q] = u->correlation[from * n + to];
        }
    }
}

/* C_xx^-1 V C_xx^-1 of the numbers index[0..n-1], or C_xx^-1 without variances. False when C_xx cannot be inverted. */
static bool core(const struct uncertainty *joint, const size_t *index, size_t n, const double *variance, double *out)
{
    double c_xx[X * X], inverse[X * X];
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) c_xx[a * n + b] = joint->cov[index[a] * joint->n_param + index[b]];
    if (n == 0 || !small_invert(c_xx, n, inverse)) return false;
    memcpy(out, inverse, n * n * sizeof *out);
    if (variance == NULL) return true;
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) {
            out[a * n + b] = 0.0;
            for (size_t k = 0; k < n; k++) out[a * n + b] += inverse[a * n + k] * variance[k] * inverse[k * n + b];
        }
    return true;
}

static void update_correlations(const double *before, struct uncertainty *u)
{
    size_t m = u->n_param;
    for (size_t p = 0; p < m; p++)
        for (size_t q = 0; q < m; q++)
            if (p != q && before[p] > 0.0 && before[q] > 0.0)
                u->correlation[p * m + q] =
                    fmin(fmax(u->cov[p * m + q] / sqrt(u->cov[p * m + p] * u->cov[q * m + q]), -1.0), 1.0);
}

void carried_error_add(const struct uncertainty *joint, size_t first, size_t n_number, const double *variance,
                       struct uncertainty *out)
{
    size_t index[X], n_free = 0, n = joint->n_param, m = out->n_param;
    double middle[X * X], own[X], before[FIT_MAX_PARAM];
    for (size_t k = first; k < first + n_number; k++) {
        if (!(joint->cov[k * n + k] > 0.0)) continue;
        own[n_free] = variance != NULL ? variance[k - first] : 0.0;
        index[n_free++] = k;
    }
    if (!core(joint, index, n_free, variance != NULL ? own : NULL, middle)) return;
    for (size_t p = 0; p < m; p++) before[p] = out->cov[p * m + p];
    for (size_t p = 0; p < m; p++) {
        for (size_t q = 0; q < m; q++) {
            size_t jp = p < first ? p : p + n_number, jq = q < first ? q : q + n_number;
            for (size_t a = 0; a < n_free && before[p] > 0.0 && before[q] > 0.0; a++)
                for (size_t b = 0; b < n_free; b++)
                    out->cov[p * m + q] +=
                        joint->cov[jp * n + index[a]] * middle[a * n_free + b] * joint->cov[jq * n + index[b]];
        }
    }
    for (size_t p = 0; p < m; p++)
        if (before[p] > 0.0) out->se_param[p] *= sqrt(out->cov[p * m + p] / before[p]);
    update_correlations(before, out);
}

void carried_error_limit(const struct param_info *info, const struct fit_parameter *parameter, struct uncertainty *u)
{
    for (size_t p = 0; p < u->n_param; p++) {
        struct coordinate c;
        if (!(u->cov[p * u->n_param + p] > 0.0)) continue;
        coordinate_init(&c, &info[p], parameter[p].lower, parameter[p].upper);
        u->se_param[p] = fmin(u->se_param[p], (parameter[p].upper - parameter[p].lower) / sqrt(12.0));
        u->determined[p] = uncertainty_determined(&c, sqrt(u->cov[p * u->n_param + p]), u->se_param[p]);
    }
}
