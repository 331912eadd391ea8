#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/models/dielectric/dielectric.h"

#include <stdlib.h>
#include <string.h>

enum { N_WAVE = 128 };
enum quantity { VALUE, BY_C_T, BY_ETA, N_QUANTITY };
#define LEAST_FACTOR 5.5 /* waves with k w above this have a factor below exp(-5.5^2 / 2) = 3e-7 */

/* Fourier coefficients of one mode: sum over the offsets of A cos(k Phi), and their derivatives by C_T and eta. */
struct spectrum {
    double c[N_WAVE][3][N_QUANTITY];
};

struct work {
    struct spectrum mode[DIELECTRIC_N_LOBE];
    double cosine[N_WAVE][DIELECTRIC_N_PHI + 1];
    double column[3][N_QUANTITY + 1][DIELECTRIC_N_PHI + 1];          /* the last one: by gamma */
    double offset[DIELECTRIC_N_OFFSET], weight[DIELECTRIC_N_OFFSET]; /* x in (0, pi/2) and cos x dx, of sum 1 */
};

static double mode_width(int p, double gamma) { return sqrt(p + 1.0) * gamma; }

static int n_wave(int p, double gamma)
{
    int n = (int)(LEAST_FACTOR / mode_width(p, gamma)) + 2;
    return n < N_WAVE ? n : N_WAVE;
}

static void fill_work(struct work *w)
{
    dielectric_offsets(w->offset, w->weight);
    for (int k = 0; k < N_WAVE; k++)
        for (int j = 0; j <= DIELECTRIC_N_PHI; j++) w->cosine[k][j] = cos(k * j * M_PI / DIELECTRIC_N_PHI);
}

/* A(-h) = A(h) and Phi(-h) = -Phi(h), so N is even and half of the offsets are enough. */
static void add_waves(struct spectrum *mode, int n, const struct dielectric_shares share[3], int p, double weight,
                      double azimuth, double d_azimuth)
{
    double c1 = cos(azimuth), s1 = sin(azimuth), c = 1, s = 0;
    for (int k = 0; k < n; k++) {
        for (int channel = 0; channel < 3; channel++) {
            const struct dielectric_shares *a = &share[channel];
            double *to = mode->c[k][channel];
            to[VALUE] += weight * a->value[p] * c;
            to[BY_C_T] += weight * a->d_c_t[p] * c;
            to[BY_ETA] += weight * (a->d_eta[p] * c - k * d_azimuth * a->value[p] * s);
        }
        double next = c * c1 - s * s1;
        s = s * c1 + c * s1;
        c = next;
    }
}

static void add_offsets(struct work *w, struct scattering_state *s, const double *param, int row)
{
    double cosine = fmax((double)row / DIELECTRIC_N_ROW, DIELECTRIC_LEAST_COSINE), eta = param[DIELECTRIC_P_ETA];
    double rest[3][N_QUANTITY] = {{0}}, energy[DIELECTRIC_N_MODE][3] = {{0}};
    for (int i = 0; i < DIELECTRIC_N_OFFSET; i++) {
        double x = w->offset[i];
        struct dielectric_ray ray = dielectric_ray_at(cosine, x, eta);
        struct dielectric_shares share[3];
        for (int c = 0; c < 3; c++) {
            double c_t = param[DIELECTRIC_P_C_T + c];
            share[c] = dielectric_shares_of(&ray, c_t, log(c_t));
            rest[c][VALUE] += w->weight[i] * share[c].value[DIELECTRIC_REST];
            rest[c][BY_C_T] += w->weight[i] * share[c].d_c_t[DIELECTRIC_REST];
            rest[c][BY_ETA] += w->weight[i] * share[c].d_eta[DIELECTRIC_REST];
        }
        for (int p = 0; p < DIELECTRIC_N_MODE; p++)
            for (int c = 0; c < 3; c++) energy[p][c] += w->weight[i] * share[c].value[p];
        for (int p = 0; p < DIELECTRIC_N_LOBE; p++) {
            double d_azimuth, azimuth = dielectric_azimuth(&ray, p, x, &d_azimuth);
            add_waves(&w->mode[p], n_wave(p, param[DIELECTRIC_P_GAMMA]), share, p, w->weight[i], azimuth, d_azimuth);
        }
    }
    struct dielectric_row *r = &s->row[row];
    for (int c = 0; c < 3; c++) {
        r->rest[c] = (float)(rest[c][VALUE] * (0.5 / M_PI));
        r->d_rest[0][c] = (float)(rest[c][BY_C_T] * (0.5 / M_PI));
        r->d_rest[1][c] = (float)(rest[c][BY_ETA] * (0.5 / M_PI));
        for (int p = 0; p < DIELECTRIC_N_MODE; p++) r->energy[p][c] = (float)energy[p][c];
    }
}

/* N and its derivatives over the azimuths, from the coefficients. */
static void sum_waves(struct work *w, int p, double gamma)
{
    double width = mode_width(p, gamma), d_width = sqrt(p + 1.0);
    memset(w->column, 0, sizeof w->column);
    for (int k = 0; k < n_wave(p, gamma); k++) {
        double factor = exp(-0.5 * k * k * width * width) * (k == 0 ? 0.5 / M_PI : 1 / M_PI);
        double by_gamma = -(double)k * k * width * d_width;
        for (int c = 0; c < 3; c++)
            for (int q = 0; q <= N_QUANTITY; q++) {
                double v = factor * (q < N_QUANTITY ? w->mode[p].c[k][c][q] : w->mode[p].c[k][c][VALUE] * by_gamma);
                for (int j = 0; j <= DIELECTRIC_N_PHI; j++) w->column[c][q][j] += v * w->cosine[k][j];
            }
    }
}

/* Where a lobe has faded, the series leaves a ripple of either sign: 0 there. */
static bool faded(const struct work *w, int c, int j) { return w->column[c][VALUE][j] <= 1e-6; }

static void store(const struct work *w, struct scattering_state *s, int row, int p)
{
    for (int j = 0; j <= DIELECTRIC_N_PHI; j++) {
        struct dielectric_cell *cell = &s->cell[row][j];
        struct dielectric_slope *slope = &s->slope[row][j];
        for (int c = 0; c < 3; c++) {
            double out[N_QUANTITY + 1];
            for (int q = 0; q <= N_QUANTITY; q++) out[q] = faded(w, c, j) ? 0 : w->column[c][q][j];
            if (p == DIELECTRIC_R) {
                cell->r = (float)out[VALUE];
                for (int k = 0; k < 2; k++) slope->r[k] = (float)out[BY_ETA + k];
                continue;
            }
            cell->inner[p - 1][c] = (float)out[VALUE];
            for (int k = 0; k < 3; k++) slope->inner[p - 1][k][c] = (float)out[BY_C_T + k];
        }
    }
}

static void store_density(const struct work *w, struct dielectric_row *row, int p)
{
    double mean[DIELECTRIC_N_PHI + 1];
    for (int j = 0; j <= DIELECTRIC_N_PHI; j++) {
        mean[j] = 0;
        for (int c = 0; c < 3; c++) mean[j] += fmax(w->column[c][VALUE][j], 0) / 3;
    }
    azimuth_density(mean, DIELECTRIC_N_PHI, row->density[p], row->below[p]);
}

status dielectric_tables(struct scattering_state *s, const double *param, struct error *err)
{
    struct work *w = malloc(sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    fill_work(w);
    for (int row = 0; row <= DIELECTRIC_N_ROW; row++) {
        memset(w->mode, 0, sizeof w->mode);
        add_offsets(w, s, param, row);
        for (int p = 0; p < DIELECTRIC_N_LOBE; p++) {
            sum_waves(w, p, param[DIELECTRIC_P_GAMMA]);
            store(w, s, row, p);
            store_density(w, &s->row[row], p);
        }
    }
    free(w);
    return STATUS_OK;
}
