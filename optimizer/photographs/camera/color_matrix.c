#include "optimizer/photographs/camera/color_matrix.h"

#include <math.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void color_matrix_apply(const double matrix[9], const double in[3], double out[3])
{
    double v[3] = {in[0], in[1], in[2]};
    for (size_t k = 0; k < 3; k++) out[k] = dot(matrix + 3 * k, v);
}

void color_matrix_apply_image(const double matrix[9], struct image *im)
{
    for (size_t i = 0; i < im->width * im->height; i++) {
        float *p = im->pixel + 3 * i;
        double v[3] = {(double)p[0], (double)p[1], (double)p[2]}, out[3];
        color_matrix_apply(matrix, v, out);
        for (size_t c = 0; c < 3; c++) p[c] = (float)out[c];
    }
}

/* ---- color difference ---- */

static double lab_curve(double t) { return t > 216.0 / 24389.0 ? cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0; }

static void lab_of(const double rgb[3], double lab[3])
{
    static const double xyz[3][3] = {
        {0.4124564, 0.3575761, 0.1804375}, {0.2126729, 0.7151522, 0.0721750}, {0.0193339, 0.1191920, 0.9503041}};
    double f[3];
    for (size_t k = 0; k < 3; k++) f[k] = lab_curve(dot(xyz[k], rgb) / (xyz[k][0] + xyz[k][1] + xyz[k][2]));
    lab[0] = 116.0 * f[1] - 16.0;
    lab[1] = 500.0 * (f[0] - f[1]);
    lab[2] = 200.0 * (f[1] - f[2]);
}

static double degrees(double x) { return x * 180.0 / M_PI; }
static double cos_deg(double x) { return cos(x * M_PI / 180.0); }

static double hue_deg(double a, double b)
{
    double h = a == 0.0 && b == 0.0 ? 0.0 : degrees(atan2(b, a));
    return h < 0.0 ? h + 360.0 : h;
}

static double delta_e(const double p[3], const double q[3])
{
    double c_mean = 0.5 * (hypot(p[1], p[2]) + hypot(q[1], q[2])), c7 = pow(c_mean, 7.0);
    double g = 0.5 * (1.0 - sqrt(c7 / (c7 + pow(25.0, 7.0))));
    double a1 = (1.0 + g) * p[1], a2 = (1.0 + g) * q[1], c1 = hypot(a1, p[2]), c2 = hypot(a2, q[2]);
    double h1 = hue_deg(a1, p[2]), h2 = hue_deg(a2, q[2]), dh = h2 - h1, h = h1 + h2;
    if (c1 * c2 == 0.0) {
        dh = 0.0;
    } else {
        if (fabs(h1 - h2) > 180.0) h += h < 360.0 ? 360.0 : -360.0;
        h *= 0.5;
        dh += dh > 180.0 ? -360.0 : dh < -180.0 ? 360.0 : 0.0;
    }
    double dl = q[0] - p[0], dc = c2 - c1, dh_length = 2.0 * sqrt(c1 * c2) * sin(0.5 * dh * M_PI / 180.0);
    double l = 0.5 * (p[0] + q[0]) - 50.0, c = 0.5 * (c1 + c2);
    double t = 1.0 - 0.17 * cos_deg(h - 30.0) + 0.24 * cos_deg(2.0 * h) + 0.32 * cos_deg(3.0 * h + 6.0) -
               0.20 * cos_deg(4.0 * h - 63.0);
    double sl = 1.0 + 0.015 * l * l / sqrt(20.0 + l * l), sc = 1.0 + 0.045 * c, sh = 1.0 + 0.015 * c * t;
    double turn = 30.0 * exp(-pow((h - 275.0) / 25.0, 2.0)), cc7 = pow(c, 7.0);
    double rt = -2.0 * sqrt(cc7 / (cc7 + pow(25.0, 7.0))) * sin(2.0 * turn * M_PI / 180.0);
    double x = dl / sl, y = dc / sc, z = dh_length / sh;
    return sqrt(fmax(0.0, x * x + y * y + z * z + rt * y * z));
}

double color_delta_e_2000(const double a_rgb[3], const double b_rgb[3])
{
    double a[3], b[3];
    lab_of(a_rgb, a);
    lab_of(b_rgb, b);
    return delta_e(a, b);
}
