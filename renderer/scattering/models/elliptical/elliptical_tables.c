#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/models/elliptical/elliptical.h"

#include <stdlib.h>
#include <string.h>

enum { N_WAVE = 96 };
/* Values of a table, and derivatives; that by gamma follows from the values. */
enum quantity {
    VALUE = ELLIPTICAL_VALUE,
    BY_C_T = ELLIPTICAL_BY_C_T,
    BY_ETA = ELLIPTICAL_BY_ETA,
    BY_RATIO = ELLIPTICAL_BY_RATIO,
    N_SUM = ELLIPTICAL_N_SUM,
    BY_GAMMA = N_SUM,
    N_QUANTITY
};
#define LEAST_FACTOR 5.5 /* waves with k w above this have a factor below exp(-5.5^2 / 2) = 3e-7 */
#define FADED 3e-6
#define LEAST_COSINE 1e-3 /* of th_d: at 0 all light is reflected */

struct work {
    double wave[ELLIPTICAL_N_LOBE][N_WAVE][3][N_SUM]; /* Fourier coefficients: mean of A cos(k Phi), and derivatives */
    double cosine[N_WAVE][ELLIPTICAL_N_PHI + 1];
    double column[3][N_QUANTITY][ELLIPTICAL_N_PHI + 1];
    double rest[3][N_SUM], energy[ELLIPTICAL_N_MODE][3];
    struct ellipse_entry entry[ELLIPTICAL_N_RAY];
    struct dual weight[ELLIPTICAL_N_RAY]; /* of the mean over all rays: sum 1 */
};

static double mode_width(int p, double gamma) { return sqrt(p + 1.0) * gamma; }

static int n_wave(int p, double gamma)
{
    int n = (int)(LEAST_FACTOR / mode_width(p, gamma)) + 2;
    return n < N_WAVE ? n : N_WAVE;
}

/* Azimuths over half a turn, after which the section is the same again, and x over the width, where rays crowd at the
 * rims. The mirrored rays make N even and need not be traced. */
static void enter_rays(struct work *w, const struct ellipse *e)
{
    struct dual sum = {0, {0, 0}};
    for (int i = 0; i < ELLIPTICAL_N_RAY; i++) {
        double x = M_PI * ((i + 0.5) / ELLIPTICAL_N_RAY - 0.5);
        double phi = M_PI * (i * ELLIPTICAL_RAY_STEP % ELLIPTICAL_N_RAY) / ELLIPTICAL_N_RAY;
        w->entry[i] = ellipse_enter(e, phi, x);
        struct dual *to = &w->weight[i], h = w->entry[i].half_width;
        *to = (struct dual){h.v * cos(x), {h.d[0] * cos(x), h.d[1] * cos(x)}};
        sum.v += to->v;
        for (int k = 0; k < 2; k++) sum.d[k] += to->d[k];
    }
    for (int i = 0; i < ELLIPTICAL_N_RAY; i++) {
        struct dual *to = &w->weight[i];
        for (int k = 0; k < 2; k++) to->d[k] = (to->d[k] - to->v / sum.v * sum.d[k]) / sum.v;
        to->v /= sum.v;
    }
}

static void add_waves(double (*wave)[3][N_SUM], int n, double a[3][N_SUM], struct dual azimuth)
{
    double c1 = cos(azimuth.v), s1 = sin(azimuth.v), c = 1, s = 0;
    for (int k = 0; k < n; k++) {
        for (int channel = 0; channel < 3; channel++) {
            double *to = wave[k][channel];
            const double *from = a[channel];
            to[VALUE] += from[VALUE] * c;
            to[BY_C_T] += from[BY_C_T] * c;
            to[BY_ETA] += from[BY_ETA] * c - k * azimuth.d[0] * from[VALUE] * s;
            to[BY_RATIO] += from[BY_RATIO] * c - k * azimuth.d[1] * from[VALUE] * s;
        }
        double next = c * c1 - s * s1;
        s = s * c1 + c * s1;
        c = next;
    }
}

static void add_ray(struct work *w, const struct ellipse_path *path, struct dual weight, const double *param,
                    struct dual energies[ELLIPTICAL_N_MODE])
{
    for (int p = 0; p < path->n; p++) {
        struct dual share = elliptical_weighted(weight, path->share[p]);
        int mode = p < ELLIPTICAL_REST ? p : ELLIPTICAL_REST;
        double a[3][N_SUM];
        energies[mode].v += share.v;
        for (int k = 0; k < 2; k++) energies[mode].d[k] += share.d[k];
        for (int c = 0; c < 3; c++) {
            elliptical_absorbed(share, path->length[p], param[ELLIPTICAL_P_C_T + c], a[c]);
            w->energy[mode][c] += a[c][VALUE];
            for (int q = 0; q < N_SUM && mode == ELLIPTICAL_REST; q++) w->rest[c][q] += a[c][q];
        }
        if (mode < ELLIPTICAL_REST) add_waves(w->wave[p], n_wave(p, param[ELLIPTICAL_P_GAMMA]), a, path->azimuth[p]);
    }
}

static void add_rays(struct work *w, struct elliptical_row *row, const struct ellipse *e, const double *param,
                     double cosine, struct dual energies[ELLIPTICAL_N_MODE])
{
    const struct ellipse_wall wall = ellipse_wall_at(e, fmax(cosine, LEAST_COSINE));
    memset(w->wave, 0, sizeof w->wave);
    memset(w->rest, 0, sizeof w->rest);
    memset(w->energy, 0, sizeof w->energy);
    for (int i = 0; i < ELLIPTICAL_N_RAY; i++) {
        struct ellipse_path path;
        ellipse_follow(e, &wall, &w->entry[i], &path);
        add_ray(w, &path, w->weight[i], param, energies);
    }
    for (int c = 0; c < 3; c++) {
        row->rest[c] = (float)(w->rest[c][VALUE] * (0.5 / M_PI));
        for (int k = 0; k <= ELLIPTICAL_D_RATIO; k++)
            row->d_rest[k][c] = (float)(w->rest[c][BY_C_T + k] * (0.5 / M_PI));
        for (int p = 0; p < ELLIPTICAL_N_MODE; p++) row->energy[p][c] = (float)w->energy[p][c];
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
            for (int q = 0; q < N_QUANTITY; q++) {
                double v = factor * (q < N_SUM ? w->wave[p][k][c][q] : w->wave[p][k][c][VALUE] * by_gamma);
                for (int j = 0; j <= ELLIPTICAL_N_PHI; j++) w->column[c][q][j] += v * w->cosine[k][j];
            }
    }
}

/* Where a lobe has faded, the series leaves a ripple of either sign: 0 there. The ripple is in proportion to the light
 * of the lobe, which dark fibers have little of. */
static void store(const struct work *w, struct elliptical_cell *cell, struct elliptical_slope *slope, int p)
{
    for (int j = 0; j <= ELLIPTICAL_N_PHI; j++)
        for (int c = 0; c < 3; c++) {
            bool faded = w->column[c][VALUE][j] <= FADED * w->wave[p][0][c][VALUE];
            cell[j].n[p][c] = faded ? 0 : (float)w->column[c][VALUE][j];
            for (int k = 0; k < ELLIPTICAL_N_SLOPE; k++)
                slope[j].n[p][k][c] = faded ? 0 : (float)w->column[c][BY_C_T + k][j];
        }
}

static void store_density(const struct work *w, struct elliptical_row *row, int p)
{
    double mean[ELLIPTICAL_N_PHI + 1];
    for (int j = 0; j <= ELLIPTICAL_N_PHI; j++) {
        mean[j] = 0;
        for (int c = 0; c < 3; c++) mean[j] += fmax(w->column[c][VALUE][j], 0) / 3;
    }
    azimuth_density(mean, ELLIPTICAL_N_PHI, row->density[p], row->below[p]);
}

status elliptical_tables(struct scattering_state *s, const double *param, struct elliptical_energies *energies,
                         struct error *err)
{
    struct work *w = malloc(sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    const struct ellipse e = ellipse_of(param[ELLIPTICAL_P_ETA], param[ELLIPTICAL_P_RATIO]);
    const double gamma = param[ELLIPTICAL_P_GAMMA];
    for (int k = 0; k < N_WAVE; k++)
        for (int j = 0; j <= ELLIPTICAL_N_PHI; j++) w->cosine[k][j] = cos(k * j * M_PI / ELLIPTICAL_N_PHI);
    enter_rays(w, &e);
    memset(energies, 0, sizeof *energies);
    for (int row = 0; row <= ELLIPTICAL_N_ROW; row++) {
        add_rays(w, &s->row[row], &e, param, (double)row / ELLIPTICAL_N_ROW, energies->share[row]);
        for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) {
            sum_waves(w, p, gamma);
            store(w, s->cell[row], s->slope[row], p);
            store_density(w, &s->row[row], p);
        }
    }
    free(w);
    return STATUS_OK;
}
