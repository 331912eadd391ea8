#include "renderer/scattering/models/microfacet/microfacet.h"
#include "renderer/scattering/tilted_lobe.h"

#include <stdlib.h>
#include <string.h>

enum { N = MICROFACET_N_SCALE_NODE, N_BY = MICROFACET_N_SCALE };
/* Every so many azimuths of the tables; the trapezoidal rule over half a turn. R is smooth. */
enum { INNER_STEP = 2, N_INNER = MICROFACET_N_PHI / INNER_STEP, R_STEP = 4, N_R = MICROFACET_N_PHI / R_STEP };

/* Light of a pair of directions, and its derivatives. */
struct light {
    double v, d[N_BY];
};

struct balance {
    struct lobe_balance solver;
    struct light inner[MICROFACET_N_ROW + 1][2 * N]; /* all but R, by row and by so many nodes of th_i + th_o */
    double d[N_BY][N][N];                            /* of the kernel */
    double a[N], d_ln_a[N], cos_phi[N_R + 1];        /* at the azimuths of R */
};

static double node_rad(int i) { return i * M_PI_2 / (N - 1); }

static double phi_weight(int j, int n) { return 2 * M_PI / n * (j == 0 || j == n ? 0.5 : 1); }

/* ---- TT, TRT and the rest ---- */

/* A lobe with the light n. Where shift and width do not change, their derivatives are NULL. */
struct lobe {
    double n, d_n[N_BY];
    struct tilted_lobe along;
    const float *d_shift, *d_width; /* by N_BY and by MICROFACET_N_BY parameters */
};

static void add_lobe(struct light *to, const struct lobe *l, float x)
{
    float d[2];
    const double m = (double)tilted_lobe_eval(&l->along, x, d);
    to->v += l->n * m;
    for (int k = 0; k < N_BY; k++) {
        double by = l->d_n[k] * m;
        if (l->d_shift != NULL) by += l->n * (double)(d[0] * l->d_shift[k]);
        if (k < MICROFACET_N_BY) by += l->n * (double)(d[1] * l->d_width[k]);
        to->d[k] += by;
    }
}

static void add_lobe_everywhere(struct light *to, const struct lobe *l)
{
    for (int i = 0; i < 2 * N; i++) {
        if (node_rad(i) > (double)(fabsf(l->along.shift) + 6.5f * l->along.width)) break;
        add_lobe(&to[i], l, (float)node_rad(i));
    }
}

static void fill_inner(const struct scattering_state *s, const struct microfacet_clear *clear, struct balance *b)
{
    memset(b->inner, 0, sizeof b->inner);
    for (int row = 0; row <= MICROFACET_N_ROW; row++) {
        const struct microfacet_row *r = &s->row[row];
        struct lobe rest = {2 * M_PI * clear[row].rest, {0}, {0, r->width}, NULL, r->d_width};
        for (int k = 0; k < MICROFACET_N_BY; k++) rest.d_n[k] = 2 * M_PI * clear[row].d_rest[k];
        add_lobe_everywhere(b->inner[row], &rest);
        for (int p = 0; p < MICROFACET_N_INNER; p++)
            for (int j = 0; j <= N_INNER; j++) {
                const int at = j * INNER_STEP;
                const double weight = phi_weight(j, N_INNER);
                const struct microfacet_cell *cell = &s->cell[row][at];
                const struct microfacet_slope *slope = &s->slope[row][at];
                struct lobe l = {weight * clear[row].n[p][at],
                                 {0},
                                 {cell->shift[p], cell->width[p]},
                                 slope->shift[p],
                                 slope->width[p]};
                for (int k = 0; k < MICROFACET_N_BY; k++) l.d_n[k] = weight * clear[row].d[k][p][at];
                add_lobe_everywhere(b->inner[row], &l);
            }
    }
}

/* ---- R ---- */

static const int by_surface[MICROFACET_R_N_BY] = {MICROFACET_BY_ETA, MICROFACET_BY_ROUGHNESS, MICROFACET_BY_TAU};

/* Of two angles, at a row of the table and beyond it. */
static void add_reflected(const struct scattering_state *s, const struct balance *b, const double theta[2], int row,
                          float x, struct light *to)
{
    const double c0 = cos(theta[0]), c1 = cos(theta[1]), u = sin(theta[0]) + sin(theta[1]);
    for (int j = 0; j <= N_R; j++) {
        const double across = fmax(c0 * c0 + c1 * c1 + 2 * c0 * c1 * b->cos_phi[j], 1e-12), t = fabs(u) / sqrt(across);
        if (t > (double)(s->surface.tilt + 6 * s->surface.roughness)) continue;
        const double inv = 1 / sqrt(across);
        const float cos_alpha[2] = {(float)((c0 + c1 * b->cos_phi[j]) * inv), (float)((c1 + c0 * b->cos_phi[j]) * inv)};
        float d[MICROFACET_R_N_BY], d_seen;
        const float seen = microfacet_seen_at(&s->row[row], x, cos_alpha, &d_seen);
        if (!(seen > 0)) continue;
        const double r = (double)microfacet_reflected(&s->surface, (float)t, 0.5f * (float)sqrt(across + u * u), d);
        const double weight = phi_weight(j, N_R);
        to->v += weight * (double)seen * r;
        for (int k = 0; k < MICROFACET_R_N_BY; k++) to->d[by_surface[k]] += weight * (double)(seen * d[k]);
        to->d[MICROFACET_BY_ROUGHNESS] += weight * r * (double)d_seen;
    }
}

/* ---- the scale ---- */

/* Adds the light that goes between th_i at node i and th_o at node -j (j may be negative). */
static void add_pair(const struct scattering_state *s, const struct balance *b, int i, int j, struct light *to)
{
    const int distance = abs(i - j), half = i + j;
    int row;
    const float x = table_position((float)cos(0.5 * node_rad(abs(half))) * MICROFACET_N_ROW, MICROFACET_N_ROW, &row);
    const struct light *before = &b->inner[row][distance], *after = &b->inner[row + 1][distance];
    to->v += before->v + (double)x * (after->v - before->v);
    for (int k = 0; k < N_BY; k++) to->d[k] += before->d[k] + (double)x * (after->d[k] - before->d[k]);
    const double theta[2] = {node_rad(i), -node_rad(j)};
    add_reflected(s, b, theta, row, x, to);
}

/* Lobes are even in th_i + th_o and th_d, so the kernel of both signs of th_o folds to one. */
static void fill_kernel(const struct scattering_state *s, struct balance *b)
{
    for (int i = 0; i < N; i++)
        for (int j = 0; j <= i; j++) {
            struct light sum = {0, {0}};
            add_pair(s, b, i, j, &sum);
            add_pair(s, b, i, -j, &sum);
            for (int k = 0; k < N_BY; k++) b->d[k][i][j] = b->d[k][j][i] = sum.d[k];
            b->solver.kernel[i][j] = b->solver.kernel[j][i] = sum.v;
        }
}

status microfacet_balance(struct scattering_state *s, const struct microfacet_clear clear[MICROFACET_N_ROW + 1],
                          struct error *err)
{
    struct balance *b = malloc(sizeof *b);
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    b->solver.n = N;
    for (int i = 0; i < N; i++) {
        const double c = cos(node_rad(i));
        b->solver.weight[i] = c * c * node_rad(1) * (i == 0 ? 0.5 : 1); /* the weight of the pole is 0 */
        b->solver.want[i] = 1;
    }
    for (int j = 0; j <= N_R; j++) b->cos_phi[j] = cos(j * M_PI / N_R);
    fill_inner(s, clear, b);
    fill_kernel(s, b);
    lobe_balance_solve(&b->solver, b->a);
    for (int i = 0; i < N; i++) s->scale[i] = (float)b->a[i];
    for (int k = 0; k < N_BY; k++) {
        for (int i = 0; i < N; i++) memcpy(b->solver.d_kernel[i], b->d[k][i], sizeof b->d[k][i]);
        lobe_balance_source_of_kernel(&b->solver, b->a);
        lobe_balance_solve_derivative(&b->solver, b->a, b->d_ln_a);
        for (int i = 0; i < N; i++) s->d_ln_scale[k][i] = (float)b->d_ln_a[i];
    }
    free(b);
    return STATUS_OK;
}
