#include "renderer/scattering/lobe_balance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = LOBE_BALANCE_N };

double lobe_balance_angle_rad(int i) { return i * M_PI_2 / (N - 1); }

void lobe_balance_init(struct lobe_balance *b)
{
    const double h = M_PI_2 / (N - 1);
    b->n = N;
    for (int i = 0; i < N; i++) {
        double c = cos(i * h);
        b->weight[i] = c * c * h * (i == 0 ? 0.5 : 1); /* the weight of the pole is 0 */
    }
    memset(b->share, 0, sizeof b->share); /* kernels of slope 0 read it before the caller sets it */
}

/* Light at t leaves about -t: at u with the difference angle (t - u) / 2, or folded (t + u) / 2, the other way round
 * than the distance in g. */
void lobe_balance_fill_kernel(struct lobe_balance *b, double beta, double constant, double slope)
{
    const double h = M_PI_2 / (N - 1);
    double g[2 * N], d_g[2 * N]; /* by distance in nodes */
    for (int i = 0; i < 2 * N; i++) {
        double z = i * h / beta;
        g[i] = exp(-0.5 * z * z) / (sqrt(2 * M_PI) * beta);
        d_g[i] = g[i] * (z * z - 1) / beta;
    }
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            int near = abs(i - j), far = i + j;
            double k_near = constant + slope * b->share[far], k_far = constant + slope * b->share[near];
            b->kernel[i][j] = g[near] * k_near + g[far] * k_far;
            b->d_kernel[i][j] = d_g[near] * k_near + d_g[far] * k_far;
        }
}

/* y_i = sum of m_ij weight_j x_j, column by column so that it vectorises. */
void lobe_balance_multiply(const struct lobe_balance *b, double (*m)[N], const double *x, double *y)
{
    const int n = b->n;
    memset(y, 0, (size_t)n * sizeof *y);
    for (int j = 0; j < n; j++) {
        double wx = b->weight[j] * x[j];
        for (int i = 0; i < n; i++) y[i] += m[j][i] * wx;
    }
}

void balance_equation_solve(const struct balance_equation *e, double *x)
{
    for (int iteration = 0; iteration < 200; iteration++) {
        e->multiply(e->kernel, x, e->work);
        double worst = 0;
        for (int i = 0; i < e->n; i++) {
            worst = fmax(worst, fabs(x[i] * e->work[i] / e->want[i] - 1));
            x[i] = sqrt(x[i] * e->want[i] / e->work[i]);
        }
        if (worst < 1e-9) break;
    }
}

/* d ln x of the equation above: (I + P) d = source, P = diag(x / want) K diag(x), whose rows sum to 1. Chebyshev's
 * iteration for eigenvalues of I + P in [1, 2]: each step leaves 0.17 of the error. Eigenvalues below 1 take more steps
 * and converge all the same. */
void balance_equation_derivative(const struct balance_equation *e, const double *x, const double *source, double *d)
{
    const double middle = 1.5, half = 0.5;
    double *xd = e->work + e->n, *step = e->work + 2 * e->n, rho = half / middle;
    for (int i = 0; i < e->n; i++) d[i] = step[i] = source[i] / middle;
    for (int iteration = 0; iteration < 200; iteration++) {
        for (int i = 0; i < e->n; i++) xd[i] = x[i] * d[i];
        e->multiply(e->kernel, xd, e->work);
        const double next = 1 / (2 * middle / half - rho);
        double worst = 0;
        for (int i = 0; i < e->n; i++) {
            double residual = source[i] - d[i] - x[i] / e->want[i] * e->work[i];
            worst = fmax(worst, fabs(residual));
            step[i] = next * rho * step[i] + 2 * next / half * residual;
            d[i] += step[i];
        }
        rho = next;
        if (worst < 1e-7) break;
    }
}

static void multiply(void *balance, const double *x, double *y)
{
    struct lobe_balance *b = balance;
    lobe_balance_multiply(b, b->kernel, x, y);
}

static struct balance_equation equation_of(struct lobe_balance *b)
{
    return (struct balance_equation){b->n, multiply, b, b->want, b->work};
}

void lobe_balance_solve(struct lobe_balance *b, double *x)
{
    const struct balance_equation e = equation_of(b);
    for (int i = 0; i < b->n; i++) x[i] = 1;
    balance_equation_solve(&e, x);
}

void lobe_balance_solve_derivative(struct lobe_balance *b, const double *x, double *d)
{
    const struct balance_equation e = equation_of(b);
    balance_equation_derivative(&e, x, b->source, d);
}

/* source = -x (dK x) / want: the kernel's own width. */
void lobe_balance_source_of_kernel(struct lobe_balance *b, const double *x)
{
    lobe_balance_multiply(b, b->d_kernel, x, b->source);
    for (int i = 0; i < b->n; i++) b->source[i] *= -x[i] / b->want[i];
}

void lobe_balance_r(struct lobe_balance *b, double beta, double *a, double *d_ln_a)
{
    for (int i = 0; i < N; i++) b->want[i] = 1;
    lobe_balance_fill_kernel(b, beta, 1, 0);
    lobe_balance_solve(b, a);
    lobe_balance_source_of_kernel(b, a);
    lobe_balance_solve_derivative(b, a, d_ln_a);
}

void lobe_balance_share(struct lobe_balance *b, double beta, const double *a, const double *d_ln_a, double *rho,
                        double *d_rho)
{
    double da[N], ka[N];
    lobe_balance_fill_kernel(b, beta, 0, 1);
    lobe_balance_multiply(b, b->kernel, a, ka);
    for (int i = 0; i < N; i++) {
        rho[i] = a[i] * ka[i];
        d_rho[i] = rho[i] * d_ln_a[i];
        da[i] = a[i] * d_ln_a[i];
    }
    lobe_balance_multiply(b, b->kernel, da, b->work);
    lobe_balance_multiply(b, b->d_kernel, a, ka);
    for (int i = 0; i < N; i++) d_rho[i] += a[i] * (b->work[i] + ka[i]);
}

/* f at table entry i of twice as many: cubic through four nodes, f even about the first. */
double lobe_balance_at_entry(const double *f, int i)
{
    int j = i / 2;
    if (i % 2 == 0) return f[j];
    int k = j > N - 3 ? N - 3 : j; /* one-sided at the pole */
    double before = f[k > 0 ? k - 1 : 1];
    return j == k ? (9 * (f[k] + f[k + 1]) - before - f[k + 2]) / 16
                  : (before - 5 * f[k] + 15 * f[k + 1] + 5 * f[k + 2]) / 16;
}
