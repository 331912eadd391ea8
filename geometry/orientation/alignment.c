#include "geometry/orientation/alignment.h"
#include "base/angle.h"

#include <math.h>

static const double LEAST_Z = 0.35; /* share of fibers along z at which the axes are wrong if warp or weft is missing */

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static double length(const double a[3]) { return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

/* Writes the rows of the inverse of the matrix with columns u, v, w. */
static void inverse_of_columns(const double u[3], const double v[3], const double w[3], double out[9])
{
    double vw[3], wu[3], uv[3];
    cross(v, w, vw);
    cross(w, u, wu);
    cross(u, v, uv);
    double det = u[0] * vw[0] + u[1] * vw[1] + u[2] * vw[2];
    for (int a = 0; a < 3; a++) {
        out[a] = vw[a] / det;
        out[3 + a] = wu[a] / det;
        out[6 + a] = uv[a] / det;
    }
}

/* Writes the columns of the identity rotated by the shortest way that brings `axis` to u. */
static void turned_frame(const double u[3], int axis, double column[3][3])
{
    double e[3] = {0.0}, k[3];
    e[axis] = 1.0;
    cross(e, u, k);
    double c = u[axis];
    for (int b = 0; b < 3; b++) { /* rotation formula of Rodrigues */
        double x[3] = {0.0}, kx[3], along = 0.0;
        x[b] = 1.0;
        cross(k, x, kx);
        for (int a = 0; a < 3; a++) along += k[a] * x[a];
        for (int a = 0; a < 3; a++) column[b][a] = c * x[a] + kx[a] + k[a] * along / (1.0 + c);
    }
}

/* Puts a direction without a repeat into the plane of x and y: less than a repeat of crimped yarns may lean, so the
 * part out of the plane is not a tilt of the cloth. */
static void flattened(const struct main_directions *m, int p, double u[3])
{
    const double flat[3] = {m->direction[p][0], m->direction[p][1], m->repeat_m[p] > 0.0 ? m->direction[p][2] : 0.0};
    double norm = length(flat);
    for (int a = 0; a < 3; a++) u[a] = norm > 0.0 ? flat[a] / norm : 0.0;
}

static void align_one(const struct main_directions *m, int axis, const double u[3], struct alignment *a)
{
    double column[3][3];
    turned_frame(u, axis, column);
    inverse_of_columns(column[0], column[1], column[2], a->matrix);
    a->rotation_deg = angle_to_deg(axis == 0 ? atan2(u[1], u[0]) : atan2(-u[0], u[1]));
    a->tilt_deg = angle_to_deg(asin(fmin(1.0, fabs(u[2]))));
    a->se_deg = m->se_deg[axis];
    a->tilt_se_deg = m->tilt_se_deg[axis];
}

void alignment_from_directions(const struct main_directions *m, struct alignment *a)
{
    *a = (struct alignment){.outcome = ALIGN_NO_DIRECTION, .matrix = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}};
    if (m->n < 2 && m->share_z > LEAST_Z) a->outcome = ALIGN_OTHER_AXES;
    if (m->n == 0 || a->outcome == ALIGN_OTHER_AXES) return;
    for (int p = 0; p < 2; p++) {
        const double *u = m->direction[p];
        if (length(u) > 0.5 && (fabs(u[2]) > 0.7072 || u[p] < 0.5)) {
            a->outcome = ALIGN_OTHER_AXES;
            return;
        }
    }
    a->outcome = ALIGN_DONE;
    double u[3], v[3];
    flattened(m, 0, u);
    flattened(m, 1, v);
    if (m->n == 1) {
        align_one(m, length(u) > 0.5 ? 0 : 1, length(u) > 0.5 ? u : v, a);
        return;
    }
    double w[3], dot = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    cross(u, v, w);
    double norm = length(w);
    for (int i = 0; i < 3; i++) w[i] /= norm;
    inverse_of_columns(u, v, w, a->matrix);
    a->rotation_deg = angle_to_deg(atan2(u[1], u[0]));
    a->shear_deg = angle_to_deg(acos(dot)) - 90.0;
    a->tilt_deg = angle_to_deg(acos(fmin(1.0, fabs(w[2]))));
    a->se_deg = fmax(m->se_deg[0], m->se_deg[1]);
    a->tilt_se_deg = fmax(m->tilt_se_deg[0], m->tilt_se_deg[1]);
}
