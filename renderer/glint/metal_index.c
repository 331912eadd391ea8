#include "renderer/glint/metal_index.h"

#include "renderer/image/observer_weights.h"

#include <complex.h>
#include <math.h>
#include <string.h>

enum { N_ENERGY = 19 };
#define NM_TIMES_EV 1239.84198

/* Rows are eV, n, k. */
struct index_row {
    double energy_ev, n, k;
};
static const struct {
    const char *name;
    struct index_row row[N_ENERGY];
} table[METAL_N] = {
    {"silver",
     {{1.39, 0.04, 6.312},
      {1.51, 0.04, 5.727},
      {1.64, 0.03, 5.242},
      {1.76, 0.04, 4.838},
      {1.88, 0.05, 4.483},
      {2.01, 0.06, 4.152},
      {2.13, 0.05, 3.858},
      {2.26, 0.06, 3.586},
      {2.38, 0.05, 3.324},
      {2.50, 0.05, 3.093},
      {2.63, 0.05, 2.869},
      {2.75, 0.04, 2.657},
      {2.88, 0.04, 2.462},
      {3.00, 0.05, 2.275},
      {3.12, 0.05, 2.070},
      {3.25, 0.05, 1.864},
      {3.37, 0.07, 1.657},
      {3.50, 0.10, 1.419}}},
    {"gold",
     {{1.39, 0.17, 5.663},
      {1.51, 0.16, 5.083},
      {1.64, 0.14, 4.542},
      {1.76, 0.13, 4.103},
      {1.88, 0.14, 3.697},
      {2.01, 0.21, 3.272},
      {2.13, 0.29, 2.863},
      {2.26, 0.43, 2.455},
      {2.38, 0.62, 2.081},
      {2.50, 1.04, 1.833},
      {2.63, 1.31, 1.849},
      {2.75, 1.38, 1.914},
      {2.88, 1.45, 1.948},
      {3.00, 1.46, 1.958},
      {3.12, 1.47, 1.952},
      {3.25, 1.46, 1.933},
      {3.37, 1.48, 1.895},
      {3.50, 1.50, 1.866}}},
    {"copper",
     {{1.39, 0.30, 5.768},
      {1.51, 0.26, 5.180},
      {1.64, 0.24, 4.665},
      {1.76, 0.21, 4.205},
      {1.88, 0.22, 3.747},
      {2.01, 0.30, 3.205},
      {2.13, 0.70, 2.704},
      {2.26, 1.02, 2.577},
      {2.38, 1.18, 2.608},
      {2.50, 1.22, 2.564},
      {2.63, 1.25, 2.483},
      {2.75, 1.24, 2.397},
      {2.88, 1.25, 2.305},
      {3.00, 1.28, 2.207},
      {3.12, 1.32, 2.116},
      {3.25, 1.33, 2.045},
      {3.37, 1.36, 1.975},
      {3.50, 1.37, 1.916}}},
    {"aluminium",
     {{1.4, 2.237, 8.212},
      {1.5, 2.745, 8.309},
      {1.6, 2.625, 8.597},
      {1.7, 2.143, 8.573},
      {1.8, 1.741, 8.205},
      {1.9, 1.488, 7.821},
      {2.0, 1.304, 7.479},
      {2.2, 1.018, 6.846},
      {2.4, 0.826, 6.283},
      {2.6, 0.695, 5.800},
      {2.8, 0.598, 5.385},
      {3.0, 0.523, 5.024},
      {3.2, 0.460, 4.708},
      {3.4, 0.407, 4.426},
      {3.6, 0.363, 4.174}}},
};

const char *metal_name(enum metal metal) { return table[metal].name; }

bool metal_find(const char *name, enum metal *metal)
{
    for (int i = 0; i < METAL_N; i++)
        if (strcmp(table[i].name, name) == 0) {
            *metal = (enum metal)i;
            return true;
        }
    return false;
}

void metal_index(enum metal metal, double wavelength_nm, double n_k[2])
{
    const struct index_row *row = table[metal].row;
    const double energy = NM_TIMES_EV / wavelength_nm;
    size_t i = 0;
    while (i + 2 < N_ENERGY && row[i + 2].energy_ev > 0 && row[i + 1].energy_ev < energy) i++;
    const double share = (energy - row[i].energy_ev) / (row[i + 1].energy_ev - row[i].energy_ev);
    n_k[0] = row[i].n + share * (row[i + 1].n - row[i].n);
    n_k[1] = row[i].k + share * (row[i + 1].k - row[i].k);
}

double conductor_reflectance(const double n_k[2], double cos_i)
{
    const double complex index = n_k[0] + I * n_k[1], inside = csqrt(index * index - (1 - cos_i * cos_i));
    const double s = cabs((cos_i - inside) / (cos_i + inside));
    const double p = cabs((index * index * cos_i - inside) / (index * index * cos_i + inside));
    return 0.5 * (s * s + p * p);
}

void metal_reflectance_rgb(enum metal metal, double cos_i, double rgb[3])
{
    double sum[3] = {0};
    memset(rgb, 0, 3 * sizeof *rgb);
    for (int i = 0; i < OBSERVER_N; i++) {
        const double nm = OBSERVER_FIRST_NM + i * OBSERVER_STEP_NM;
        double n_k[2];
        metal_index(metal, nm, n_k);
        const double f = conductor_reflectance(n_k, cos_i);
        for (size_t c = 0; c < 3; c++) {
            rgb[c] += f * observer_weight(nm, c);
            sum[c] += observer_weight(nm, c);
        }
    }
    for (int c = 0; c < 3; c++) rgb[c] /= sum[c];
}
