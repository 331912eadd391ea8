#include "renderer/scattering/models/fur/fur_far.h"

#include <stdlib.h>
#include <string.h>

/* Waves for widths from a degree, the least gamma. */
enum { N_WAVE = 320, N_MEDULLA_WAVE = 48, LEAST_OFFSET = 160 };
/* Values of a table, and derivatives in the order of fur_far_by; the derivative by gamma follows from the values. */
enum { VALUE, BY = 1, N_SUM = BY + FUR_F_GAMMA, BY_GAMMA = N_SUM, N_QUANTITY };
#define LEAST_FACTOR 5.5 /* waves with k w above this have a factor below exp(-5.5^2 / 2) = 3e-7 */
#define FADED 3e-6

/* Data that all rows need. */
struct common {
    double cosine[N_WAVE][FUR_N_PHI + 1];
    struct fur_fiber fiber;
    struct medulla_around around;
    float even[MEDULLA_ROUND_RANK][N_MEDULLA_WAVE], odd[MEDULLA_ROUND_RANK][N_MEDULLA_WAVE];
    double c_t[3], gamma;
    int n_color; /* 1 where all channels have the same C_T, and so the same tables; else 3 */
};

/* A row at hand. */
struct work {
    const struct common *all;
    double wave[FUR_FAR_N_LOBE][3][N_SUM][N_WAVE]; /* Fourier coefficients: mean of A cos(k Phi), and derivatives */
    double column[3][N_QUANTITY][FUR_N_PHI + 1];
    double rest[3][N_SUM], energy[FUR_FAR_N_MODE][3];
};

/* The channel whose tables channel c has. */
static int color_of(const struct work *w, int c) { return w->all->n_color == 1 ? 0 : c; }

static double mode_width(int p, double gamma) { return sqrt(p + 1.0) * gamma; }

static int n_wave(int p, double gamma)
{
    if (p == FUR_FAR_S) return N_MEDULLA_WAVE;
    int n = (int)(LEAST_FACTOR / mode_width(p, gamma)) + 2;
    return n < N_WAVE ? n : N_WAVE;
}

/* Weight times share of a mode in one channel, and its derivatives. */
static void amplitude(const struct work *w, const struct fur_ray *ray, double weight, int c,
                      double out[FUR_N_MODE][N_SUM])
{
    const double ln_c = log(w->all->c_t[c]);
    const struct fur_shares a = fur_shares_of(&w->all->fiber, ray, ln_c);
    double part[FUR_N_PART][FUR_N_BY];
    fur_parts(&w->all->fiber, ray, ln_c, part);
    for (int mode = 0; mode < FUR_N_MODE; mode++) {
        double slope[FUR_N_BY];
        fur_share_slopes(&a, mode, part, slope);
        out[mode][VALUE] = weight * a.value[mode];
        for (int k = 0; k < FUR_N_BY; k++) out[mode][BY + k] = weight * slope[k];
        out[mode][BY + FUR_F_C] /= w->all->c_t[c];
        out[mode][BY + FUR_F_G] = 0;
    }
}

/* cos(k phi) and sin(k phi) by k, in steps of N_STEP so that neighbours are made side by side. */
enum { N_STEP = 8 };
_Static_assert(N_WAVE % N_STEP == 0 && N_MEDULLA_WAVE % N_STEP == 0, "waves come in whole steps");

struct turns {
    double c[N_WAVE], s[N_WAVE];
};

static void fill_turns(struct turns *t, double phi, int n)
{
    const double c1 = cos(phi), s1 = sin(phi);
    double c = 1, s = 0; /* of N_STEP times the angle, in the end */
    for (int k = 0; k < N_STEP; k++) {
        t->c[k] = c;
        t->s[k] = s;
        const double next = c * c1 - s * s1;
        s = s * c1 + c * s1;
        c = next;
    }
    for (int k = N_STEP; k < n; k += N_STEP)
        for (int i = 0; i < N_STEP; i++) {
            const double c0 = t->c[k - N_STEP + i], s0 = t->s[k - N_STEP + i];
            t->c[k + i] = c0 * c - s0 * s;
            t->s[k + i] = s0 * c + c0 * s;
        }
}

/* Several rays at a time, so that each sum is read and written once for all of them. */
enum { N_SIDE = 4 };
_Static_assert(LEAST_OFFSET % N_SIDE == 0, "rays come in whole groups");

struct lobe_rays {
    double a[FUR_N_LOBE][3][N_SUM][N_SIDE]; /* weight times share of each lobe in each colour, and derivatives */
    double phi[FUR_N_LOBE][N_SIDE], d_phi[FUR_N_LOBE][N_SIDE]; /* azimuth of exit; by eta */
};

static void put_lobes(struct lobe_rays *y, int side, const struct fur_ray *ray, double x,
                      double a[FUR_N_MODE][3][N_SUM], int n_color)
{
    for (int p = 0; p < FUR_N_LOBE; p++) {
        y->phi[p][side] = 2 * p * ray->gamma_t - 2 * x + p * M_PI;
        y->d_phi[p][side] = 2 * p * ray->d_gamma_t;
        for (int c = 0; c < n_color; c++)
            for (int q = 0; q < N_SUM; q++) y->a[p][c][q][side] = a[p][c][q];
    }
}

/* Adds the waves cos(k Phi) of one lobe of all rays. Quantities on which a lobe does not depend are 0 for all. */
static void add_lobe(struct work *w, const struct lobe_rays *y, int p)
{
    struct turns t[N_SIDE];
    const int n = n_wave(p, w->all->gamma);
    for (int i = 0; i < N_SIDE; i++) fill_turns(&t[i], y->phi[p][i], n);
    for (int c = 0; c < w->all->n_color; c++)
        for (int q = 0; q < N_SUM; q++) {
            const double *a = y->a[p][c][q], a0 = a[0], a1 = a[1], a2 = a[2], a3 = a[3];
            double *restrict to = w->wave[p][c][q];
            if (a0 == 0 && a1 == 0 && a2 == 0 && a3 == 0) continue;
            for (int k = 0; k < n; k++) to[k] += a0 * t[0].c[k] + a1 * t[1].c[k] + a2 * t[2].c[k] + a3 * t[3].c[k];
        }
    for (int c = 0; c < w->all->n_color && p > 0; c++) {
        double *restrict to = w->wave[p][c][BY + FUR_F_ETA], turn[N_SIDE];
        for (int i = 0; i < N_SIDE; i++) turn[i] = y->a[p][c][VALUE][i] * y->d_phi[p][i];
        for (int k = 0; k < n; k++)
            to[k] -= k * (turn[0] * t[0].s[k] + turn[1] * t[1].s[k] + turn[2] * t[2].s[k] + turn[3] * t[3].s[k]);
    }
}

/* Waves of the density of one ray, even and odd ones, and their derivatives. */
struct medulla_spectrum {
    float even[1 + MEDULLA_RAY_N_BY][N_MEDULLA_WAVE], odd[1 + MEDULLA_RAY_N_BY][N_MEDULLA_WAVE];
};

static void fill_spectrum(const struct common *all, const struct medulla_ray *m, struct medulla_spectrum *y)
{
    memset(y, 0, sizeof *y);
    for (int q = 0; q <= MEDULLA_RAY_N_BY; q++) {
        const float *weight = q == 0 ? m->weight : m->d[q - 1];
        medulla_add_waves(weight, all->even[0], N_MEDULLA_WAVE, y->even[q]);
        medulla_add_waves(weight, all->odd[0], N_MEDULLA_WAVE, y->odd[q]);
    }
}

/* Adds the light of one segment: wave k has the factor even_k cos(k Phi) - odd_k sin(k Phi). */
static void add_segment(struct work *w, const struct fur_ray *ray, const struct medulla_spectrum *y, int segment,
                        double x, double a[3][N_SUM])
{
    double d_eta, phi = fur_segment_azimuth(ray, segment, x, &d_eta), d_depth[3];
    double by[1 + MEDULLA_RAY_N_BY][N_MEDULLA_WAVE], turned[N_MEDULLA_WAVE],
        factor[FUR_F_GAMMA][N_MEDULLA_WAVE] = {{0}};
    struct turns t;
    fur_depth(&w->all->fiber, ray, d_depth);
    fill_turns(&t, phi, N_MEDULLA_WAVE);
    for (int q = 0; q <= MEDULLA_RAY_N_BY; q++)
        for (int k = 0; k < N_MEDULLA_WAVE; k++)
            by[q][k] = t.c[k] * (double)y->even[q][k] - t.s[k] * (double)y->odd[q][k];
    for (int k = 0; k < N_MEDULLA_WAVE; k++)
        turned[k] = k * d_eta * (t.s[k] * (double)y->even[0][k] + t.c[k] * (double)y->odd[0][k]);
    const double *by_depth = by[1 + MEDULLA_RAY_BY_DEPTH], *by_offset = by[1 + MEDULLA_RAY_BY_OFFSET];
    for (int k = 0; k < N_MEDULLA_WAVE; k++) {
        factor[FUR_F_ETA][k] = by_depth[k] * d_depth[0] + by_offset[k] * ray->offset.eta - turned[k];
        factor[FUR_F_KAPPA][k] = by_depth[k] * d_depth[1] + by_offset[k] * ray->offset.kappa;
        factor[FUR_F_MS][k] = by_depth[k] * d_depth[2];
        factor[FUR_F_G][k] = by[1 + MEDULLA_RAY_BY_G][k];
    }
    for (int c = 0; c < w->all->n_color; c++)
        for (int q = 0; q < N_SUM; q++) {
            const double of_share = a[c][q], of_factor = q >= BY ? a[c][VALUE] : 0;
            const double *slope = factor[q >= BY ? q - BY : 0];
            double *restrict to = w->wave[FUR_FAR_S][c][q];
            for (int k = 0; k < N_MEDULLA_WAVE; k++) to[k] += of_share * by[0][k] + of_factor * slope[k];
        }
}

/* One offset. All rays carry lobes, which go to one side of `lobes`; every `coarse`th carries the scattered light,
 * which is smooth, with their weight. */
static void add_ray(struct work *w, double cosine, double x, double weight, int coarse, struct lobe_rays *lobes,
                    int side)
{
    const struct fur_ray ray = fur_ray_at(&w->all->fiber, cosine, x);
    double a[FUR_N_MODE][3][N_SUM];
    for (int c = 0; c < w->all->n_color; c++) {
        double out[FUR_N_MODE][N_SUM];
        amplitude(w, &ray, weight, c, out);
        for (int mode = 0; mode < FUR_N_MODE; mode++) memcpy(a[mode][c], out[mode], sizeof out[mode]);
        for (int p = 0; p < FUR_N_LOBE; p++) w->energy[p][c] += out[p][VALUE];
        w->energy[FUR_FAR_S][c] += out[FUR_TT_S][VALUE] + out[FUR_TRT_S][VALUE];
        w->energy[FUR_FAR_REST][c] += out[FUR_REST][VALUE];
        for (int q = 0; q < N_SUM; q++) w->rest[c][q] += out[FUR_REST][q];
    }
    put_lobes(lobes, side, &ray, x, a, w->all->n_color);
    if (coarse == 0) return;
    struct medulla_ray m;
    struct medulla_spectrum y;
    double unused[3];
    medulla_ray_init(&w->all->around, fur_depth(&w->all->fiber, &ray, unused), ray.offset.v, &m);
    fill_spectrum(w->all, &m, &y);
    for (int segment = 1; segment <= FUR_N_SEGMENT; segment++) {
        double(*b)[N_SUM] = a[FUR_TT_S + segment - 1];
        for (int c = 0; c < w->all->n_color; c++)
            for (int q = 0; q < N_SUM; q++) b[c][q] *= coarse;
        add_segment(w, &ray, &y, segment, x, b);
    }
}

/* Offsets x crowd at the rims; narrow lobes need as many as they have waves, three times LEAST_OFFSET at most. */
static void add_rays(struct work *w, struct fur_row *row, double cosine)
{
    const int coarse = n_wave(FUR_R, w->all->gamma) > LEAST_OFFSET - 20 ? 3 : 1, n = coarse * LEAST_OFFSET;
    struct lobe_rays lobes;
    double sum = 0;
    for (int p = 0; p < FUR_FAR_N_LOBE; p++) memset(w->wave[p], 0, (size_t)w->all->n_color * sizeof w->wave[p][0]);
    memset(w->rest, 0, sizeof w->rest);
    memset(w->energy, 0, sizeof w->energy);
    for (int i = 0; i < n; i++) sum += cos((i + 0.5) * M_PI_2 / n);
    for (int i = 0; i < n; i++) {
        double x = (i + 0.5) * M_PI_2 / n;
        add_ray(w, cosine, x, cos(x) / sum, i % coarse == coarse / 2 ? coarse : 0, &lobes, i % N_SIDE);
        for (int p = 0; p < FUR_N_LOBE && i % N_SIDE == N_SIDE - 1; p++) add_lobe(w, &lobes, p);
    }
    for (int c = 0; c < 3; c++) {
        const int of = color_of(w, c);
        row->rest[c] = (float)(w->rest[of][VALUE] * (0.5 / M_PI));
        for (int q = 0; q < FUR_F_G; q++) row->d_rest[q][c] = (float)(w->rest[of][BY + q] * (0.5 / M_PI));
        for (int p = 0; p < FUR_FAR_N_MODE; p++) row->energy[p][c] = (float)w->energy[p][of];
    }
}

/* N and its derivatives over the azimuths, from the coefficients. */
static void sum_waves(struct work *w, int p)
{
    const bool lobe = p < FUR_N_LOBE;
    double width = lobe ? mode_width(p, w->all->gamma) : 0, d_width = sqrt(p + 1.0);
    memset(w->column, 0, sizeof w->column);
    for (int k = 0, n = n_wave(p, w->all->gamma); k < n; k++) {
        double factor = exp(-0.5 * k * k * width * width) * (k == 0 ? 0.5 / M_PI : 1 / M_PI);
        double by_gamma = -(double)k * k * width * d_width;
        for (int c = 0; c < w->all->n_color; c++)
            for (int q = 0; q < N_QUANTITY; q++) {
                const double v = factor * (q < N_SUM ? w->wave[p][c][q][k] : w->wave[p][c][VALUE][k] * by_gamma);
                if (v == 0) continue;
                for (int j = 0; j <= FUR_N_PHI; j++) w->column[c][q][j] += v * w->all->cosine[k][j];
            }
    }
}

/* Where a lobe has faded, the series leaves a ripple of either sign: 0 there. */
static void store(const struct work *w, struct fur_cell *cell, struct fur_slope *slope, struct fur_row *row, int p)
{
    double mean[FUR_N_PHI + 1];
    for (int j = 0; j <= FUR_N_PHI; j++) {
        mean[j] = 0;
        for (int c = 0; c < 3; c++) {
            const int of = color_of(w, c);
            bool faded = w->column[of][VALUE][j] <= FADED * w->wave[p][of][VALUE][0];
            mean[j] += faded ? 0 : w->column[of][VALUE][j] / 3;
            cell[j].n[p][c] = faded ? 0 : (float)w->column[of][VALUE][j];
            for (int q = 0; q < FUR_F_N; q++) slope[j].n[p][q][c] = faded ? 0 : (float)w->column[of][BY + q][j];
        }
    }
    azimuth_density(mean, FUR_N_PHI, row->density[p], row->below[p]);
}

/* cos(k ph) at the azimuths of the table, which are among the 2 FUR_N_PHI azimuths of a turn. */
static void fill_cosines(struct common *all)
{
    double of_turn[2 * FUR_N_PHI];
    for (int i = 0; i < 2 * FUR_N_PHI; i++) of_turn[i] = cos(i * M_PI / FUR_N_PHI);
    for (int k = 0; k < N_WAVE; k++)
        for (int j = 0; j <= FUR_N_PHI; j++) all->cosine[k][j] = of_turn[k * j % (2 * FUR_N_PHI)];
}

static void fill_common(struct common *all, const double *param)
{
    const double *c_t = all->c_t;
    float even[N_MEDULLA_WAVE][MEDULLA_ROUND_RANK], odd[N_MEDULLA_WAVE][MEDULLA_ROUND_RANK];
    all->fiber = fur_fiber_of(param);
    all->gamma = param[FUR_P_GAMMA];
    for (int c = 0; c < 3; c++) all->c_t[c] = param[FUR_P_C_T + c];
    all->n_color =
        memcmp(&c_t[0], &c_t[1], sizeof(double)) == 0 && memcmp(&c_t[0], &c_t[2], sizeof(double)) == 0 ? 1 : 3;
    fill_cosines(all);
    medulla_around_init(&all->around, param[FUR_P_G]);
    medulla_waves(N_MEDULLA_WAVE, even, odd);
    for (int k = 0; k < N_MEDULLA_WAVE; k++)
        for (int r = 0; r < MEDULLA_ROUND_RANK; r++) {
            all->even[r][k] = even[k][r];
            all->odd[r][k] = odd[k][r];
        }
}

struct rows {
    struct scattering_state *state;
    struct work *work; /* of each thread */
};

static void fill_row(void *context, size_t row, size_t i_thread)
{
    const struct rows *r = context;
    struct scattering_state *s = r->state;
    struct work *w = &r->work[i_thread];
    add_rays(w, &s->row[row], fmax((double)row / FUR_FAR_ROW, FUR_LEAST_COSINE));
    for (int p = 0; p < FUR_FAR_N_LOBE; p++) {
        sum_waves(w, p);
        store(w, s->cell[row], s->slope[row], &s->row[row], p);
    }
}

status fur_far_tables(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err)
{
    const size_t n_thread = thread_pool_n_thread(pool);
    struct common *all = malloc(sizeof *all);
    struct rows rows = {s, calloc(n_thread, sizeof *rows.work)};
    status st = STATUS_OK;
    if (all == NULL || rows.work == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    } else {
        fill_common(all, param);
        for (size_t i = 0; i < n_thread; i++) rows.work[i].all = all;
        st = thread_pool_run(pool, FUR_FAR_ROW + 1, fill_row, &rows, NULL);
    }
    free(all);
    free(rows.work);
    return st;
}
