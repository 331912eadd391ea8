#include "optimizer/photographs/camera/chart_reference.h"

#include "optimizer/photographs/camera/color_matrix.h"

static const double reference_lab[2][COLOR_CHART_PATCHES][3] = {
    {
        /* made before November 2014 */
        {37.986, 13.555, 14.059},  {65.711, 18.130, 17.810},   {49.927, -4.880, -21.925}, {43.139, -13.095, 21.905},
        {55.112, 8.844, -25.399},  {70.719, -33.397, -0.199},  {62.661, 36.067, 57.096},  {40.020, 10.410, -45.964},
        {51.124, 48.239, 16.248},  {30.325, 22.976, -21.587},  {72.532, -23.709, 57.255}, {71.941, 19.363, 67.857},
        {28.778, 14.179, -50.297}, {55.261, -38.342, 31.370},  {42.101, 53.378, 28.190},  {81.733, 4.039, 79.819},
        {51.935, 49.986, -14.574}, {51.038, -28.631, -28.638}, {96.539, -0.425, 1.186},   {81.257, -0.638, -0.335},
        {66.766, -0.734, -0.504},  {50.867, -0.153, -0.270},   {35.656, -0.421, -1.231},  {20.461, -0.079, -0.973},
    },
    {
        /* made in November 2014 or later */
        {37.54, 14.37, 14.92},  {64.66, 19.27, 17.50},   {49.32, -3.82, -22.54}, {43.46, -12.74, 22.72},
        {54.94, 9.61, -24.79},  {70.48, -32.26, -0.37},  {62.73, 35.83, 56.50},  {39.43, 10.75, -45.17},
        {50.57, 48.64, 16.67},  {30.10, 22.54, -20.87},  {71.77, -24.13, 58.19}, {71.51, 18.24, 67.37},
        {28.37, 15.42, -49.80}, {54.38, -39.72, 32.27},  {42.43, 51.05, 28.62},  {81.80, 2.67, 80.41},
        {50.63, 51.28, -14.12}, {49.57, -29.71, -28.32}, {95.19, -1.03, 2.93},   {81.29, -0.57, 0.44},
        {66.89, -0.75, -0.06},  {50.76, -0.13, 0.14},    {35.63, -0.46, -0.48},  {20.64, 0.07, -0.46},
    },
};

static double from_lab(double f) { return f > 6.0 / 29.0 ? f * f * f : (116.0 * f - 16.0) * 27.0 / 24389.0; }

void color_chart_reference(bool from_2014, size_t i, double rgb[3])
{
    static const double white_d50[3] = {0.96422, 1.0, 0.82521};
    /* XYZ under D50 to linear sRGB, adapted by Bradford (Lindbloom) */
    static const double to_rgb[9] = {3.1338561, -1.6168667, -0.4906146, -0.9787684, 1.9161415,
                                     0.0334540, 0.0719453,  -0.2289914, 1.4052427};
    const double *lab = reference_lab[from_2014][i];
    double fy = (lab[0] + 16.0) / 116.0;
    double xyz[3] = {white_d50[0] * from_lab(fy + lab[1] / 500.0), white_d50[1] * from_lab(fy),
                     white_d50[2] * from_lab(fy - lab[2] / 200.0)};
    color_matrix_apply(to_rgb, xyz, rgb);
}

const char *color_chart_patch_name(size_t i)
{
    static const char *const name[COLOR_CHART_PATCHES] = {
        "dark skin", "light skin",    "blue sky",     "foliage",   "blue flower",  "bluish green",
        "orange",    "purplish blue", "moderate red", "purple",    "yellow green", "orange yellow",
        "blue",      "green",         "red",          "yellow",    "magenta",      "cyan",
        "white",     "neutral 8",     "neutral 6.5",  "neutral 5", "neutral 3.5",  "black"};
    return name[i];
}
