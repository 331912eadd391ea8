#include "optimizer/photographs/rows/brdf_spectrum.h"

#include <math.h>
#include <string.h>

enum { FIRST_NM = 380, STEP_NM = 10, N = 36, LEAST_WAVELENGTHS = 8 };
static const double largest_gap_nm = 50.0;

/* The matching functions of CIE's standard observer of 1931 times the illuminant D65 (CIE 015), through the matrix of
 * IEC 61966-2-1; every channel has the sum 1. At 380, 390, ... 730 nm. */
static const double weight_of_nm[N][3] = {
    {0.00005, -0.00005, 0.00033},  {0.00018, -0.00016, 0.00111},  {0.00094, -0.00081, 0.00568},
    {0.00310, -0.00271, 0.01918},  {0.00951, -0.00848, 0.06098},  {0.01735, -0.01606, 0.12135},
    {0.02207, -0.02201, 0.18488},  {0.01635, -0.02003, 0.20880},  {0.00200, -0.01114, 0.19732},
    {-0.01618, 0.00378, 0.14723},  {-0.03393, 0.02214, 0.09182},  {-0.04616, 0.03897, 0.04649},
    {-0.06382, 0.06336, 0.02298},  {-0.08391, 0.09598, 0.00665},  {-0.09183, 0.12628, -0.00582},
    {-0.08258, 0.14858, -0.01245}, {-0.05295, 0.14904, -0.01552}, {-0.01273, 0.14240, -0.01671},
    {0.03741, 0.12208, -0.01570},  {0.09170, 0.09545, -0.01365},  {0.14796, 0.06742, -0.01132},
    {0.18154, 0.03569, -0.00808},  {0.21068, 0.01313, -0.00586},  {0.21006, -0.00238, -0.00394},
    {0.18131, -0.00941, -0.00249}, {0.13206, -0.00989, -0.00144}, {0.09372, -0.00838, -0.00085},
    {0.05716, -0.00561, -0.00046}, {0.03347, -0.00344, -0.00025}, {0.01824, -0.00192, -0.00013},
    {0.00930, -0.00100, -0.00006}, {0.00402, -0.00044, -0.00003}, {0.00207, -0.00022, -0.00001},
    {0.00109, -0.00012, -0.00001}, {0.00045, -0.00005, -0.00000}, {0.00026, -0.00003, -0.00000},
};

static double weight_at(double nm, size_t c)
{
    double at = (nm - FIRST_NM) / STEP_NM;
    if (!(at >= 0.0 && at <= N - 1)) return 0.0;
    size_t i = at < N - 1 ? (size_t)at : N - 2;
    return weight_of_nm[i][c] + (at - (double)i) * (weight_of_nm[i + 1][c] - weight_of_nm[i][c]);
}

/* Adds the integral of weight times the linear interpolation between two wavelengths, in steps of at most a
 * nanometre. */
static void add_interval(double from_nm, double to_nm, double first[3], double second[3])
{
    size_t n = (size_t)ceil(fmin(fmax(to_nm - from_nm, 1.0), 1000.0));
    for (size_t k = 0; k < n; k++) {
        double share = ((double)k + 0.5) / (double)n, width = (to_nm - from_nm) / (double)n;
        for (size_t c = 0; c < 3; c++) {
            double w = width * weight_at(from_nm + share * (to_nm - from_nm), c);
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
        for (int at = FIRST_NM - STEP_NM; at < FIRST_NM + N * STEP_NM; at++) {
            double middle = (double)at + 0.5;
            if (middle < nm[0]) below += weight_at(middle, c);
            if (middle > nm[n - 1]) above += weight_at(middle, c);
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
