#include "geometry/fibers/lines/join_curve.h"
#include "base/small_matrix.h"

#include <math.h>
#include <string.h>

enum {
    SIDE = 10,
    N_PROBE = 9
}; /* vertices of each side that the curve is fitted to; places where its curvature is evaluated */

const float *line_end_vertex(const struct polyline_set *p, uint32_t end, size_t k)
{
    size_t line = end / 2;
    return p->vertex[(end & 1u) != 0 ? p->first[line + 1] - 1 - k : p->first[line] + k];
}

static double distance(const float a[3], const float b[3])
{
    double sum = 0.0;
    for (int c = 0; c < 3; c++) sum += (double)(a[c] - b[c]) * (double)(a[c] - b[c]);
    return sqrt(sum);
}

/* Collects vertices of one side from the gap outwards, with their arc length from the gap. */
static size_t take_side(const struct polyline_set *p, uint32_t end, size_t trim, const float *vertex[SIDE],
                        double arc[SIDE])
{
    size_t length = polyline_length(p, end / 2), n = 0;
    for (size_t k = trim; k < length && n < SIDE; k++, n++) {
        vertex[n] = line_end_vertex(p, end, k);
        arc[n] = n == 0 ? 0.0 : arc[n - 1] + distance(vertex[n], vertex[n - 1]);
    }
    return n;
}

void join_curve_at(const struct join_curve *j, double u, double x[3])
{
    for (int a = 0; a < 3; a++) x[a] = j->c[0][a] + u * (j->c[1][a] + u * (j->c[2][a] + u * j->c[3][a]));
}

static double curvature_at(const struct join_curve *j, double u)
{
    double d1[3], d2[3], c[3];
    for (int a = 0; a < 3; a++) {
        d1[a] = j->c[1][a] + u * (2.0 * j->c[2][a] + u * 3.0 * j->c[3][a]);
        d2[a] = 2.0 * j->c[2][a] + 6.0 * u * j->c[3][a];
    }
    for (int a = 0; a < 3; a++) c[a] = d1[(a + 1) % 3] * d2[(a + 2) % 3] - d1[(a + 2) % 3] * d2[(a + 1) % 3];
    double speed2 = d1[0] * d1[0] + d1[1] * d1[1] + d1[2] * d1[2], cross2 = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
    return speed2 > 1e-6 ? sqrt(cross2 / (speed2 * speed2 * speed2)) : INFINITY;
}

static void add_vertex(double m[4][4], double b[4][3], double u, const float x[3])
{
    double power[4] = {1.0, u, u * u, u * u * u};
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k <= i; k++) m[i][k] += power[i] * power[k];
        for (int a = 0; a < 3; a++) b[i][a] += power[i] * (double)x[a];
    }
}

/* Squared distance of x from the curve near u, across its tangent there. */
static double residual2(const struct join_curve *j, double u, const float x[3])
{
    double y[3], t[3], norm = 0.0, along = 0.0, d2 = 0.0;
    join_curve_at(j, u, y);
    for (int a = 0; a < 3; a++) {
        t[a] = j->c[1][a] + u * (2.0 * j->c[2][a] + u * 3.0 * j->c[3][a]);
        norm += t[a] * t[a];
        along += t[a] * ((double)x[a] - y[a]);
        d2 += ((double)x[a] - y[a]) * ((double)x[a] - y[a]);
    }
    return norm > 0.0 ? fmax(0.0, d2 - along * along / norm) : d2;
}

bool join_curve_fit(const struct polyline_set *p, uint32_t a, uint32_t b, const uint8_t trim[2], struct join_curve *j)
{
    const float *va[SIDE], *vb[SIDE];
    double sa[SIDE], sb[SIDE], m[4][4] = {{0.0}}, ahead = 0.0;
    size_t na = take_side(p, a, trim[0], va, sa), nb = take_side(p, b, trim[1], vb, sb);
    if (na < 3 || nb < 3) return false;
    *j = (struct join_curve){.gap = distance(va[0], vb[0]), .trim = {trim[0], trim[1]}};
    for (int k = 0; k < 3; k++) /* the way from the far end of a to the far end of b must lead through the gap */
        ahead += (double)(vb[0][k] - va[0][k]) *
                 ((double)(va[0][k] - va[na - 1][k]) / sa[na - 1] + (double)(vb[nb - 1][k] - vb[0][k]) / sb[nb - 1]);
    if (!(ahead > 0.0)) return false;
    double length = sa[na - 1] + j->gap + sb[nb - 1];
    j->scale = 0.5 * length;
    j->from = sa[na - 1] / j->scale - 1.0;
    j->to = (sa[na - 1] + j->gap) / j->scale - 1.0;
    for (size_t i = 0; i < na; i++) add_vertex(m, j->c, j->from - sa[i] / j->scale, va[i]);
    for (size_t i = 0; i < nb; i++) add_vertex(m, j->c, j->to + sb[i] / j->scale, vb[i]);
    if (!small_factor(&m[0][0], 4, 1e-9)) return false;
    for (int axis = 0; axis < 3; axis++) small_solve(&m[0][0], 4, &j->c[0][axis], 3);
    double sum = 0.0;
    for (size_t i = 0; i < na; i++) sum += residual2(j, j->from - sa[i] / j->scale, va[i]);
    for (size_t i = 0; i < nb; i++) sum += residual2(j, j->to + sb[i] / j->scale, vb[i]);
    j->rms = sqrt(sum / (double)(na + nb));
    double margin = 3.0 / j->scale;
    for (int k = 0; k < N_PROBE; k++) {
        double u = j->from - margin + (j->to - j->from + 2.0 * margin) * k / (N_PROBE - 1);
        j->bend = fmax(j->bend, curvature_at(j, fmin(1.0, fmax(-1.0, u))));
    }
    return true;
}
