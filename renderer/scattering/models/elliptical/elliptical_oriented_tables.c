/* Tables of elliptical_oriented.v1: rays are spread over a quarter of the plane of psi and Delta by quadratic
 * B-splines, and the sums are blurred as cosine series in both. The factors of the series remove the blur of the
 * B-splines, and, in the tables that are read by straight lines, also the blur of the straight lines. The series of R
 * is known without rays (oriented_reflection.h). */
#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/models/elliptical/elliptical_oriented.h"
#include "renderer/scattering/models/elliptical/oriented_reflection.h"
#include "renderer/scattering/quadratic_spline.h"

#include <stdlib.h>
#include <string.h>

enum { N = ORIENTED_N, N_TURN = ORIENTED_N_TURN, N_LOBE = ELLIPTICAL_N_LOBE };
/* Planes of a lobe: three channels of a value and its derivatives by C_T, eta and the ratio; then without absorption.
 */
enum { N_SUM = ELLIPTICAL_N_SUM, CLEAR = 3 * N_SUM, N_PLANE = CLEAR + 3 };
#define LEAST_FACTOR 5.5  /* waves with k w above this have a factor below exp(-5.5^2 / 2) = 3e-7 */
#define LEAST_COSINE 1e-3 /* of th_d: at 0 all light is reflected */

struct work {
    oriented_plane sum[N_LOBE][N_PLANE];
    double rest[N_PLANE][N_TURN + 1];                          /* light beyond TRRT by the azimuth it came from */
    oriented_plane blurred[N_LOBE][3][1 + ELLIPTICAL_N_SLOPE]; /* for the tables */
    oriented_plane clear[N_LOBE][ORIENTED_N_PART];
    double cosine[N + 1][N + 1];
    double factor[N_LOBE][2][2][N + 1]; /* of waves: for the tables or clear; and by gamma */
    int n_wave[N_LOBE];
    reflection_wave by_psi; /* of R */
    struct ellipse_entry entry[ORIENTED_N_RAY];
    struct dual weight[ORIENTED_N_RAY]; /* sum 1 */
};

static double sinc(double x) { return x > 0 ? sin(x) / x : 1; }

/* exp(-k^2 w^2 / 2), w = sqrt(p + 1) gamma, in both directions, over the blur of B-splines (sinc^3; not of R) and of
 * straight lines (sinc^2). */
static void set_factors(struct work *w, double gamma)
{
    for (int p = 0; p < N_LOBE; p++) {
        const double square = (p + 1) * gamma * gamma;
        w->n_wave[p] = (int)fmin(N, LEAST_FACTOR / sqrt(square) + 1) + 1;
        for (int k = 0; k <= N; k++) {
            const double s = sinc(0.5 * M_PI * k / N), spread = p > 0 ? s * s * s : 1,
                         f = exp(-0.5 * k * k * square) / spread * (k > 0 ? 2 : 1);
            for (int lines = 0; lines < 2; lines++) {
                w->factor[p][lines][0][k] = lines ? f / (s * s) : f;
                w->factor[p][lines][1][k] = -(double)k * k * (p + 1) * gamma * w->factor[p][lines][0][k];
            }
        }
    }
    for (int k = 0; k <= N; k++)
        for (int j = 0; j <= N; j++) w->cosine[k][j] = cos(M_PI * k * j / N);
}

/* Azimuths over a quarter turn, and x over the width, where rays crowd at the rims; all others mirror these. */
static void enter_rays(struct work *w, const struct ellipse *e)
{
    struct dual sum = {0, {0, 0}};
    for (int i = 0; i < ORIENTED_N_RAY; i++) {
        const double x = M_PI * ((i + 0.5) / ORIENTED_N_RAY - 0.5),
                     phi = M_PI_2 * ((i * ORIENTED_RAY_STEP) % ORIENTED_N_RAY + 0.5) / ORIENTED_N_RAY;
        w->entry[i] = ellipse_enter(e, phi, x);
        const struct dual h = w->entry[i].half_width;
        w->weight[i] = (struct dual){h.v * cos(x), {h.d[0] * cos(x), h.d[1] * cos(x)}};
        sum.v += w->weight[i].v;
        for (int k = 0; k < 2; k++) sum.d[k] += w->weight[i].d[k];
    }
    for (int i = 0; i < ORIENTED_N_RAY; i++) {
        struct dual *to = &w->weight[i];
        for (int k = 0; k < 2; k++) to->d[k] = (to->d[k] - to->v / sum.v * sum.d[k]) / sum.v;
        to->v /= sum.v;
    }
}

/* Adds an exit with the planes `a`; `turn`: its azimuth less the azimuth `phi` of the ray. */
static void add_exit(oriented_plane *plane, const double a[N_PLANE], double phi, struct dual turn)
{
    const double per_psi = N / M_PI_2, per_delta = N / M_PI;
    double u[3], du[3], v[3], dv[3];
    const double delta = remainder(turn.v, 2 * M_PI);
    const int i = quadratic_spline((phi + 0.5 * delta) * per_psi, u, du),
              j = quadratic_spline(delta * per_delta, v, dv);
    for (int m = 0; m < 3; m++)
        for (int n = 0; n < 3; n++) {
            const int row = oriented_fold(i + m - 1, N), column = oriented_fold(j + n - 1, N);
            const double weight = u[m] * v[n], moved = 0.5 * per_psi * du[m] * v[n] + per_delta * u[m] * dv[n];
            for (int c = 0; c < 3; c++) {
                const double *from = a + c * N_SUM;
                oriented_plane *to = plane + c * N_SUM;
                to[ELLIPTICAL_VALUE][row][column] += from[ELLIPTICAL_VALUE] * weight;
                to[ELLIPTICAL_BY_C_T][row][column] += from[ELLIPTICAL_BY_C_T] * weight;
                for (int k = 0; k < 2; k++)
                    to[ELLIPTICAL_BY_ETA + k][row][column] +=
                        from[ELLIPTICAL_BY_ETA + k] * weight + from[ELLIPTICAL_VALUE] * turn.d[k] * moved;
            }
            plane[CLEAR][row][column] += a[CLEAR] * weight;
            for (int k = 0; k < 2; k++)
                plane[CLEAR + 1 + k][row][column] += a[CLEAR + 1 + k] * weight + a[CLEAR] * turn.d[k] * moved;
        }
}

static void add_rest(struct work *w, const double a[N_PLANE], double phi)
{
    double u[3], du[3];
    const int i = quadratic_spline(phi * (N_TURN / M_PI_2), u, du);
    for (int m = 0; m < 3; m++) {
        const int at = oriented_fold(i + m - 1, N_TURN);
        for (int q = 0; q < N_PLANE; q++) w->rest[q][at] += a[q] * u[m];
    }
}

static void add_rays(struct work *w, const struct ellipse *e, const double *param, double cosine,
                     struct dual energies[ELLIPTICAL_N_MODE])
{
    const struct ellipse_wall wall = ellipse_wall_at(e, fmax(cosine, LEAST_COSINE));
    memset(w->sum, 0, sizeof w->sum);
    memset(w->rest, 0, sizeof w->rest);
    for (int i = 0; i < ORIENTED_N_RAY; i++) {
        struct ellipse_path path;
        ellipse_follow(e, &wall, &w->entry[i], &path);
        for (int p = 0; p < path.n; p++) {
            const struct dual share = elliptical_weighted(w->weight[i], path.share[p]);
            const int mode = p < ELLIPTICAL_REST ? p : ELLIPTICAL_REST;
            double a[N_PLANE];
            if (!(share.v > 0)) continue;
            energies[mode].v += share.v;
            for (int k = 0; k < 2; k++) energies[mode].d[k] += share.d[k];
            if (p == 0) continue;
            for (int c = 0; c < 3; c++)
                elliptical_absorbed(share, path.length[p], param[ELLIPTICAL_P_C_T + c], a + c * N_SUM);
            a[CLEAR] = share.v;
            for (int k = 0; k < 2; k++) a[CLEAR + 1 + k] = share.d[k];
            if (mode < ELLIPTICAL_REST)
                add_exit(w->sum[p], a, w->entry[i].phi, path.azimuth[p]);
            else
                add_rest(w, a, w->entry[i].phi);
        }
    }
}

/* Coefficients of a plane: sums of its masses times both cosines. */
static void to_waves(struct work *w, oriented_plane plane, int n, oriented_plane wave)
{
    oriented_plane half;
    for (int i = 0; i <= N; i++)
        for (int l = 0; l < n; l++) {
            double sum = 0;
            for (int j = 0; j <= N; j++) sum += plane[i][j] * w->cosine[l][j];
            half[i][l] = sum;
        }
    memset(wave, 0, sizeof(oriented_plane));
    for (int k = 0; k < n; k++)
        for (int i = 0; i <= N; i++)
            for (int l = 0; l < n; l++) wave[k][l] += w->cosine[k][i] * half[i][l];
}

/* Adds the series of the coefficients times f by psi and g by Delta, over 2 pi. */
static void from_waves(struct work *w, oriented_plane wave, int n, const double *f, const double *g, oriented_plane out)
{
    oriented_plane half;
    for (int k = 0; k < n; k++)
        for (int j = 0; j <= N; j++) {
            double sum = 0;
            for (int l = 0; l < n; l++) sum += wave[k][l] * g[l] * w->cosine[l][j];
            half[k][j] = sum * f[k] * (0.5 / M_PI);
        }
    for (int i = 0; i <= N; i++)
        for (int k = 0; k < n; k++)
            for (int j = 0; j <= N; j++) out[i][j] += w->cosine[k][i] * half[k][j];
}

/* Blurs a plane, given as waves; by_gamma too unless NULL. lines: for tables that are read by straight lines. */
static void blur_waves(struct work *w, int p, int lines, oriented_plane wave, oriented_plane out,
                       double (*by_gamma)[N + 1])
{
    const double *f = w->factor[p][lines][0], *d = w->factor[p][lines][1];
    memset(out, 0, sizeof(oriented_plane));
    from_waves(w, wave, w->n_wave[p], f, f, out);
    if (by_gamma == NULL) return;
    memset(by_gamma, 0, sizeof(oriented_plane));
    from_waves(w, wave, w->n_wave[p], d, f, by_gamma);
    from_waves(w, wave, w->n_wave[p], f, d, by_gamma);
}

static void blur(struct work *w, int p, int lines, oriented_plane plane, oriented_plane out, double (*by_gamma)[N + 1])
{
    oriented_plane wave;
    to_waves(w, plane, w->n_wave[p], wave);
    blur_waves(w, p, lines, wave, out, by_gamma);
}

/* R, which has no color: its value and its derivatives by eta, the ratio and gamma. */
static void blur_reflection(struct work *w, double eta, double cosine)
{
    reflection_wave by_delta;
    oriented_plane wave, *table = w->blurred[0][0];
    oriented_reflection_delta(eta, fmax(cosine, LEAST_COSINE), by_delta);
    for (int q = ORIENTED_VALUE; q <= ORIENTED_BY_RATIO; q++) {
        const double *psi = w->by_psi[q == ORIENTED_BY_RATIO ? REFLECTION_SLOPE : REFLECTION_VALUE],
                     *delta = by_delta[q == ORIENTED_BY_ETA ? REFLECTION_SLOPE : REFLECTION_VALUE];
        const bool value = q == ORIENTED_VALUE;
        for (int k = 0; k <= N; k++)
            for (int l = 0; l <= N; l++) wave[k][l] = psi[k] * delta[l];
        blur_waves(w, 0, 1, wave, table[value ? 0 : 1 + ELLIPTICAL_D_ETA + q - ORIENTED_BY_ETA],
                   value ? table[1 + ELLIPTICAL_D_GAMMA] : NULL);
        blur_waves(w, 0, 0, wave, w->clear[0][q], value ? w->clear[0][ORIENTED_BY_GAMMA] : NULL);
    }
    memset(table[1 + ELLIPTICAL_D_C_T], 0, sizeof(oriented_plane));
    for (int c = 1; c < 3; c++) memcpy(w->blurred[0][c], table, sizeof w->blurred[0][c]);
}

/* A function of an azimuth at half a node: index in half steps of it. */
static double at_half(const double *f, int twice)
{
    const int i = (int)floor(0.5 * twice);
    const double a = f[oriented_fold(i, N_TURN)];
    return twice % 2 == 0 ? a : 0.5 * (a + f[oriented_fold(i + 1, N_TURN)]);
}

/* Light beyond TRRT: rho(ph_i) rho(ph_o) / (2 pi mean rho), added to a plane, and its derivatives to their planes. */
static void spread_rest(const double *value, double (*d)[N_TURN + 1], int n_d, oriented_plane out,
                        oriented_plane *d_out)
{
    double rho[N_TURN + 1], slope[3][N_TURN + 1], mean = 0, d_mean[3] = {0, 0, 0};
    for (int i = 0; i <= N_TURN; i++) {
        const double per_node = i == 0 || i == N_TURN ? 2.0 * N_TURN : N_TURN; /* over the share of a turn */
        mean += value[i];
        rho[i] = value[i] * per_node;
        for (int k = 0; k < n_d; k++) {
            d_mean[k] += d[k][i];
            slope[k][i] = d[k][i] * per_node;
        }
    }
    if (!(mean > 1e-12)) return;
    for (int i = 0; i <= N; i++)
        for (int j = 0; j <= N; j++) {
            const double a = at_half(rho, i - j), b = at_half(rho, i + j), f = a * b / (2 * M_PI * mean);
            out[i][j] += f;
            for (int k = 0; k < n_d; k++)
                d_out[k][i][j] += (at_half(slope[k], i - j) * b + a * at_half(slope[k], i + j)) / (2 * M_PI * mean) -
                                  f * d_mean[k] / mean;
        }
}

static void blur_all(struct work *w)
{
    for (int p = 1; p < N_LOBE; p++) {
        for (int c = 0; c < 3; c++) {
            oriented_plane *from = w->sum[p] + c * N_SUM;
            oriented_plane *to = w->blurred[p][c];
            blur(w, p, 1, from[0], to[0], to[1 + ELLIPTICAL_D_GAMMA]);
            for (int q = 1; q < N_SUM; q++) blur(w, p, 1, from[q], to[q], NULL);
        }
        blur(w, p, 0, w->sum[p][CLEAR], w->clear[p][ORIENTED_VALUE], w->clear[p][ORIENTED_BY_GAMMA]);
        for (int k = 0; k < 2; k++) blur(w, p, 0, w->sum[p][CLEAR + 1 + k], w->clear[p][ORIENTED_BY_ETA + k], NULL);
    }
    for (int c = 0; c < 3; c++)
        spread_rest(w->rest[c * N_SUM], w->rest + c * N_SUM + 1, N_SUM - 1, w->blurred[N_LOBE - 1][c][0],
                    &w->blurred[N_LOBE - 1][c][1]);
    spread_rest(w->rest[CLEAR], w->rest + CLEAR + 1, 2, w->clear[N_LOBE - 1][ORIENTED_VALUE],
                &w->clear[N_LOBE - 1][ORIENTED_BY_ETA]);
}

/* F and its derivatives, and F without absorption by both azimuths. */
static void store(struct work *w, struct elliptical_cell (*cell)[N + 1], struct elliptical_slope (*slope)[N + 1],
                  struct oriented_row *row)
{
    for (int i = 0; i <= N; i++)
        for (int j = 0; j <= N; j++)
            for (int p = 0; p < N_LOBE; p++)
                for (int c = 0; c < 3; c++) {
                    oriented_plane *from = w->blurred[p][c];
                    const bool faded = !(from[0][i][j] > 1e-9); /* ripples of the series */
                    cell[i][j].n[p][c] = faded ? 0 : (float)from[0][i][j];
                    for (int k = 0; k < ELLIPTICAL_N_SLOPE; k++)
                        slope[i][j].n[p][k][c] = faded ? 0 : (float)from[1 + k][i][j];
                }
    for (int p = 0; p < N_LOBE; p++)
        for (int k = 0; k < ORIENTED_N_PART; k++) oriented_fold_plane(w->clear[p][k], row->f[p][k]);
}

/* Stores the light that leaves to the azimuth i by Delta, from which a mode and an azimuth are drawn. */
static void store_view(struct elliptical_cell (*cell)[N + 1], int i, struct oriented_view *view)
{
    memset(view->energy, 0, sizeof view->energy);
    for (int p = 0; p < N_LOBE; p++) {
        double value[ORIENTED_N_AROUND + 1];
        for (int l = 0; l <= ORIENTED_N_AROUND; l++) {
            const int delta = l - N;
            const struct elliptical_cell *at = &cell[oriented_fold(2 * i - delta, N)][oriented_fold(delta, N)];
            value[l] = 0;
            for (int c = 0; c < 3; c++) {
                value[l] += (double)at->n[p][c] / 3;
                if (l > 0) view->energy[p][c] += at->n[p][c] * (float)(2 * M_PI / ORIENTED_N_AROUND);
            }
        }
        azimuth_density(value, ORIENTED_N_AROUND, view->density[p], view->below[p]);
    }
}

/* Data that the tasks of all rows share. */
struct rows {
    struct scattering_state *s;
    const struct ellipse *e;
    const double *param;
    struct oriented_row *row;
    struct elliptical_energies *energies;
    struct work *work; /* one for each thread */
};

static void fill_row(void *context, size_t i, size_t i_thread)
{
    const struct rows *r = context;
    struct work *w = &r->work[i_thread];
    const double cosine = (double)i / ELLIPTICAL_N_ROW;
    add_rays(w, r->e, r->param, cosine, r->energies->share[i]);
    blur_reflection(w, r->param[ELLIPTICAL_P_ETA], cosine);
    blur_all(w);
    store(w, r->s->cell[i], r->s->slope[i], &r->row[i]);
    for (int k = 0; k <= N_TURN; k++) store_view(r->s->cell[i], k, &r->s->view[i][k]);
}

status oriented_tables(struct scattering_state *s, const double *param, struct thread_pool *pool,
                       struct oriented_row *row, struct elliptical_energies *energies, struct error *err)
{
    const size_t n_thread = thread_pool_n_thread(pool);
    struct work *w = malloc(n_thread * sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    const struct ellipse e = ellipse_of(param[ELLIPTICAL_P_ETA], param[ELLIPTICAL_P_RATIO]);
    struct rows rows = {s, &e, param, row, energies, w};
    set_factors(w, param[ELLIPTICAL_P_GAMMA]);
    enter_rays(w, &e);
    oriented_reflection_psi(param[ELLIPTICAL_P_RATIO], w->by_psi);
    for (size_t i = 1; i < n_thread; i++) w[i] = w[0];
    memset(energies, 0, sizeof *energies);
    const status st = thread_pool_run(pool, ELLIPTICAL_N_ROW + 1, fill_row, &rows, NULL);
    free(w);
    return st;
}
