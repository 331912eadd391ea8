#include "optimizer/photographs/profile/bowl_camera.h"
#include "base/option_id.h"
#include "base/small_matrix.h"
#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/document/job_profile.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_STEP = 200, TURN = 3, FOCAL = 6, N_UNKNOWN = 7 };
static const double mark_noise_px = 0.5, most_focal_sd = 0.05, most_rms = 0.01;

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void to_camera(const struct bowl_camera *k, const double at_mm[3], double q[3])
{
    double d[3];
    for (int i = 0; i < 3; i++) d[i] = at_mm[i] - k->position_mm[i];
    for (int i = 0; i < 3; i++) q[i] = dot(k->axis[i], d);
}

bool bowl_camera_project(const struct bowl_camera *k, const double at_mm[3], double px[2])
{
    double q[3];
    to_camera(k, at_mm, q);
    for (int i = 0; i < 2; i++) px[i] = k->center_px[i] + k->focal_px * q[i] / q[2];
    return q[2] > 0.0;
}

void bowl_camera_ray(const struct bowl_camera *k, const double px[2], double direction[3])
{
    const double q[3] = {(px[0] - k->center_px[0]) / k->focal_px, (px[1] - k->center_px[1]) / k->focal_px, 1.0};
    const double size = sqrt(dot(q, q));
    for (int i = 0; i < 3; i++)
        direction[i] = (q[0] * k->axis[0][i] + q[1] * k->axis[1][i] + q[2] * k->axis[2][i]) / size;
}

/* The marks of a fit, without the distortion of the lens. */
struct marks {
    const struct job_bowl *bowl;
    double px[JOB_MAX_BOWL_MARK][2];
    bool fits_focal;
};

/* A camera that looks straight down, turned, at the height and place that suit the marks best as a plane. */
static void first_guess(const struct marks *m, double width, double height, struct bowl_camera *k)
{
    const struct job_bowl *b = m->bowl;
    const double n = (double)b->n_mark;
    double at[3] = {0}, px[2] = {0}, along = 0.0, across = 0.0, size = 0.0;
    for (size_t i = 0; i < b->n_mark; i++) {
        for (int c = 0; c < 3; c++) at[c] += b->mark[i].at_mm[c] / n;
        for (int c = 0; c < 2; c++) px[c] += m->px[i][c] / n;
    }
    for (size_t i = 0; i < b->n_mark; i++) {
        const double x = b->mark[i].at_mm[0] - at[0], y = b->mark[i].at_mm[1] - at[1], u = m->px[i][0] - px[0],
                     v = m->px[i][1] - px[1];
        along += u * x - v * y;
        across += u * y + v * x;
        size += x * x + y * y;
    }
    const double turn = atan2(across, along), px_per_mm = fmax(hypot(along, across) / fmax(size, 1e-9), 1e-9);
    k->focal_px = m->fits_focal ? 2.0 * fmax(width, height) : b->focal_px;
    k->center_px[0] = isnan(b->center_px[0]) ? 0.5 * width : b->center_px[0];
    k->center_px[1] = isnan(b->center_px[1]) ? 0.5 * height : b->center_px[1];
    const double right[3] = {cos(turn), sin(turn), 0.0}, down[3] = {sin(turn), -cos(turn), 0.0},
                 away[3] = {0.0, 0.0, -1.0}, distance = k->focal_px / px_per_mm;
    memcpy(k->axis[0], right, sizeof right);
    memcpy(k->axis[1], down, sizeof down);
    memcpy(k->axis[2], away, sizeof away);
    for (int c = 0; c < 3; c++)
        k->position_mm[c] = at[c] - distance * away[c] - (px[0] - k->center_px[0]) / px_per_mm * right[c] -
                            (px[1] - k->center_px[1]) / px_per_mm * down[c];
}

/* Sum of squared distances in pixels; with normal not NULL also J'J (N_UNKNOWN rows) and J'r. Unknowns: the position, a
 * turn about the camera's axes, ln of the focal length. */
static double squares(const struct marks *m, const struct bowl_camera *k, double *normal, double *gradient)
{
    double sum = 0.0;
    for (size_t i = 0; i < m->bowl->n_mark; i++) {
        double q[3], jac[2][N_UNKNOWN] = {{0}};
        to_camera(k, m->bowl->mark[i].at_mm, q);
        if (!(q[2] > 1e-6)) return INFINITY;
        for (int c = 0; c < 2; c++) {
            const double at = k->focal_px * q[c] / q[2], r = k->center_px[c] + at - m->px[i][c];
            double by_q[3] = {0.0, 0.0, -at / q[2]};
            by_q[c] = k->focal_px / q[2];
            for (int u = 0; u < 3; u++) {
                const double turned[3] = {u == 1   ? q[2]
                                          : u == 2 ? -q[1]
                                                   : 0.0,
                                          u == 2   ? q[0]
                                          : u == 0 ? -q[2]
                                                   : 0.0,
                                          u == 0   ? q[1]
                                          : u == 1 ? -q[0]
                                                   : 0.0};
                for (int row = 0; row < 3; row++) jac[c][u] -= by_q[row] * k->axis[row][u];
                jac[c][TURN + u] = dot(by_q, turned);
            }
            jac[c][FOCAL] = at;
            sum += r * r;
            for (int u = 0; u < N_UNKNOWN && normal != NULL; u++) {
                gradient[u] += jac[c][u] * r;
                for (int v = 0; v < N_UNKNOWN; v++) normal[u * N_UNKNOWN + v] += jac[c][u] * jac[c][v];
            }
        }
    }
    return sum;
}

/* Turns the axes by the vector w, about themselves. */
static void turn_axes(struct bowl_camera *k, const double w[3])
{
    const double angle = sqrt(dot(w, w)), s = angle > 0.0 ? sin(angle) / angle : 1.0,
                 c = angle > 0.0 ? (1.0 - cos(angle)) / (angle * angle) : 0.5;
    for (int col = 0; col < 3; col++) {
        const double a[3] = {k->axis[0][col], k->axis[1][col], k->axis[2][col]}, along = dot(w, a);
        const double cross[3] = {w[1] * a[2] - w[2] * a[1], w[2] * a[0] - w[0] * a[2], w[0] * a[1] - w[1] * a[0]};
        for (int row = 0; row < 3; row++) k->axis[row][col] = a[row] * cos(angle) + s * cross[row] + c * along * w[row];
    }
}

/* The damped step to `next`; false where the normal matrix cannot be solved. */
static bool take_step(const struct marks *m, const struct bowl_camera *k, double damping, struct bowl_camera *next)
{
    double normal[N_UNKNOWN * N_UNKNOWN] = {0}, x[N_UNKNOWN] = {0};
    const size_t n = m->fits_focal ? N_UNKNOWN : FOCAL;
    double part[N_UNKNOWN * N_UNKNOWN];
    squares(m, k, normal, x);
    for (size_t u = 0; u < n; u++)
        for (size_t v = 0; v < n; v++) part[u * n + v] = normal[u * N_UNKNOWN + v] * (u == v ? 1.0 + damping : 1.0);
    if (!small_factor(part, n, 0.0)) return false;
    small_solve(part, n, x, 1);
    *next = *k;
    const double w[3] = {-x[TURN], -x[TURN + 1], -x[TURN + 2]};
    for (int c = 0; c < 3; c++) next->position_mm[c] -= x[c];
    turn_axes(next, w);
    if (m->fits_focal) next->focal_px *= exp(fmin(fmax(-x[FOCAL], -0.5), 0.5));
    return true;
}

static void fit(const struct marks *m, struct bowl_camera *k)
{
    double damping = 1e-3, f = squares(m, k, NULL, NULL);
    for (int i = 0; i < MOST_STEP && damping < 1e12; i++) {
        struct bowl_camera next;
        const double f_next = take_step(m, k, damping, &next) ? squares(m, &next, NULL, NULL) : INFINITY;
        if (f_next < f) {
            const bool done = f - f_next <= 1e-12 * f;
            *k = next;
            f = f_next;
            damping = fmax(0.1 * damping, 1e-12);
            if (done) break;
        } else
            damping *= 10.0;
    }
    k->rms_px = sqrt(f / (double)m->bowl->n_mark);
}

/* Standard deviation of ln of the focal length for marks that are off by their rms, at least mark_noise_px. */
static double focal_sd(const struct marks *m, const struct bowl_camera *k)
{
    double normal[N_UNKNOWN * N_UNKNOWN] = {0}, gradient[N_UNKNOWN] = {0}, inverse[N_UNKNOWN * N_UNKNOWN];
    squares(m, k, normal, gradient);
    if (!small_invert(normal, N_UNKNOWN, inverse)) return INFINITY;
    return fmax(k->rms_px, mark_noise_px) * sqrt(inverse[FOCAL * N_UNKNOWN + FOCAL]);
}

static status check_marks(const struct marks *m, const struct bowl_camera *k, double width, struct error *err)
{
    size_t worst = 0;
    double most_px = 0.0;
    for (size_t i = 0; i < m->bowl->n_mark; i++) {
        double px[2];
        const double off = bowl_camera_project(k, m->bowl->mark[i].at_mm, px)
                               ? hypot(px[0] - m->px[i][0], px[1] - m->px[i][1])
                               : INFINITY;
        if (off <= most_px) continue;
        most_px = off;
        worst = i;
    }
    char field[64];
    snprintf(field, sizeof field, OPTION_BOWL_MARK "[%zu]", worst);
    if (!(k->rms_px <= most_rms * width))
        return error_set_field(err, STATUS_INVALID, field,
                               "no place of the camera fits the marks of the bowl: they are off by %.3g pixels (root "
                               "mean square), and the worst, mark %zu, by %.3g; check 'at_mm' and 'px', and that the "
                               "picture is not mirrored",
                               k->rms_px, worst, most_px);
    if (k->position_mm[2] > m->bowl->height_mm - m->bowl->radius_mm) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_BOWL_MARKS,
                           "by the marks of the bowl the camera is at z = %.4g mm, below its rim", k->position_mm[2]);
}

status bowl_camera_fit(const struct job_bowl *bowl, const struct lens *lens, size_t width, size_t height,
                       struct bowl_camera *camera, struct error *err)
{
    struct marks m = {.bowl = bowl, .fits_focal = isnan(bowl->focal_px)};
    for (size_t i = 0; i < bowl->n_mark; i++) {
        memcpy(m.px[i], bowl->mark[i].px, sizeof m.px[i]);
        if (lens->has_distortion) lens_undistort(lens, bowl->mark[i].px, m.px[i]);
    }
    first_guess(&m, (double)width, (double)height, camera);
    fit(&m, camera);
    status s = check_marks(&m, camera, (double)width, err);
    if (s != STATUS_OK || !m.fits_focal) return s;
    const double sd = focal_sd(&m, camera);
    if (sd <= most_focal_sd) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_BOWL_FOCAL,
                           "the marks of the bowl do not tell the focal length (they leave %.0f %% of it open): give "
                           "'focal_px', or marks at different heights",
                           fmin(100.0 * sd, 100.0));
}
