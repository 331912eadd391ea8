#include "optimizer/photographs/rows/brdf_spectrum.h"

#include "renderer/image/observer_weights.h"

#include <math.h>
#include <string.h>

enum { LEAST_WAVELENGTHS = 8 };
static const double largest_gap_nm = 50.0;

/* Adds the integral of weight times the linear interpolation between two wavelengths, in steps of at most a
 * nanometre. */
static void add_interval(double from_nm, double to_nm, double first[3], double second[3])
{
    size_t n = (size_t)ceil(fmin(fmax(to_nm - from_nm, 1.0), 1000.0));
    for (size_t k = 0; k < n; k++) {
        double share = ((double)k + 0.5) / (double)n, width = (to_nm - from_nm) / (double)n;
        for (size_t c = 0; c < 3; c++) {
            double w = width * observer_weight(from_nm + share * (to_nm - from_nm), c);
            first[c] += (1.0 - share) * w;
            second[c] += share * w;
        }
    }
}

static bool gives_color(const double *nm, size_t n)
{
    size_t seen = 0;
    for (size_t i = 0; i < n; i++) {
        if (!(nm[i] > 0.0 && nm[i] < 1e6) || (i > 0 && !(nm[i] > nm[i - 1]))) return false;
        seen += nm[i] >= 400.0 && nm[i] <= 700.0;
        if (i > 0 && nm[i] > 400.0 && nm[i - 1] < 700.0 && nm[i] - nm[i - 1] > largest_gap_nm) return false;
    }
    return seen >= LEAST_WAVELENGTHS && nm[0] <= 400.0 + largest_gap_nm && nm[n - 1] >= 700.0 - largest_gap_nm;
}

bool brdf_spectrum_weights(const double *nm, size_t n, double (*weight)[3])
{
    double sum[3] = {0};
    if (!gives_color(nm, n)) return false;
    memset(weight, 0, n * sizeof *weight);
    for (size_t i = 0; i + 1 < n; i++) add_interval(nm[i], nm[i + 1], weight[i], weight[i + 1]);
    for (size_t c = 0; c < 3; c++) { /* values beyond the ends equal the values at the ends */
        double below = 0.0, above = 0.0;
        for (int at = OBSERVER_FIRST_NM - OBSERVER_STEP_NM; at < OBSERVER_FIRST_NM + OBSERVER_N * OBSERVER_STEP_NM;
             at++) {
            double middle = (double)at + 0.5;
            if (middle < nm[0]) below += observer_weight(middle, c);
            if (middle > nm[n - 1]) above += observer_weight(middle, c);
        }
        weight[0][c] += below;
        weight[n - 1][c] += above;
        for (size_t i = 0; i < n; i++) sum[c] += weight[i][c];
        for (size_t i = 0; i < n; i++) weight[i][c] /= sum[c];
    }
    return true;
}

void brdf_rgb_of_xyz(const double xyz[3], double rgb[3])
{
    static const double m[3][3] = {
        {3.2404542, -1.5371385, -0.4985314}, {-0.9692660, 1.8760108, 0.0415560}, {0.0556434, -0.2040259, 1.0572252}};
    for (size_t c = 0; c < 3; c++) rgb[c] = m[c][0] * xyz[0] + m[c][1] * xyz[1] + m[c][2] * xyz[2];
}
