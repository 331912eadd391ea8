/* The path of a yarn: its length, and the map from points of its section to space. */
#include "geometry/cloth/yarn_path.h"

#include <math.h>

/* Point and frame of the path at parameter s in [0, 1): tangent t, b in the plane of the cloth, n = t x b upwards. */
static void path_at(const struct yarn *y, double s, double point[3], double b[3], double n[3])
{
    double at = s * (double)y->n;
    size_t i = (size_t)at % y->n;
    double w = at - floor(at);
    double q[4][3];
    for (int k = 0; k < 4; k++) { /* four points around s, wrapped with the shift */
        long j = (long)i + k - 1, m = (long)y->n;
        long turn = j < 0 ? -1 : j >= m ? 1 : 0;
        for (int a = 0; a < 3; a++) q[k][a] = y->point[j - turn * m][a] + (a < 2 ? (double)turn * y->shift[a] : 0.0);
    }
    double t[3], length = 0.0;
    for (int a = 0; a < 3; a++) {
        double d1 = 0.5 * (q[2][a] - q[0][a]), d2 = 0.5 * (q[3][a] - q[1][a]);
        point[a] = q[1][a] + w * (q[2][a] - q[1][a]);
        t[a] = (1.0 - w) * d1 + w * d2;
        length += t[a] * t[a];
    }
    for (int a = 0; a < 3; a++) t[a] /= sqrt(length);
    double h = sqrt(t[0] * t[0] + t[1] * t[1]); /* paths are never vertical */
    b[0] = -t[1] / h;
    b[1] = t[0] / h;
    b[2] = 0.0;
    n[0] = t[1] * b[2] - t[2] * b[1];
    n[1] = t[2] * b[0] - t[0] * b[2];
    n[2] = t[0] * b[1] - t[1] * b[0];
}

double yarn_length_m(const struct yarn *y)
{
    double length = 0.0;
    for (size_t i = 0; i < y->n; i++) {
        double d2 = 0.0;
        for (int a = 0; a < 3; a++) {
            double next = i + 1 < y->n ? y->point[i + 1][a] : y->point[0][a] + (a < 2 ? y->shift[a] : 0.0);
            d2 += (next - y->point[i][a]) * (next - y->point[i][a]);
        }
        length += sqrt(d2);
    }
    return length;
}

void yarn_point(const struct yarn *y, const struct yarn_section *c, double s, double u_m, double v_m, double out[3])
{
    double point[3], b[3], n[3];
    double whole = floor(s);
    path_at(y, s - whole, point, b, n);
    for (int a = 0; a < 3; a++)
        out[a] = point[a] + u_m * c->wide * b[a] + v_m * c->high * n[a] + (a < 2 ? whole * y->shift[a] : 0.0);
}
