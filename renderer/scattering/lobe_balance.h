/* Balancing of longitudinal lobes: the symmetric scales a(th) and b(th) that make a lobe g(th_o; -th_i, beta)
 * reciprocal and lossless from both sides. two_lobe_balanced.c states the equations. Shared by all
 * models whose lobes are balanced.
 *
 * Functions of an angle are tabulated at LOBE_BALANCE_N equidistant nodes over [0, pi/2]; all are even. Double
 * precision.
 */
#ifndef SELVEDGE_RENDERER_LOBE_BALANCE_H
#define SELVEDGE_RENDERER_LOBE_BALANCE_H

enum { LOBE_BALANCE_N = 513 };

/* The equation x_i (K x)_i = want_i for a symmetric kernel of any layout. */
struct balance_equation {
    int n;
    void (*multiply)(void *kernel, const double *x, double *y); /* y = K x */
    void *kernel;
    const double *want;
    double *work; /* 3 n */
};
/* Finds the positive solution, beginning with the positive x. */
void balance_equation_solve(const struct balance_equation *e, double *x);
/* Derivative of ln x from `source`, the derivative of ln want less x (dK x) / want. */
void balance_equation_derivative(const struct balance_equation *e, const double *x, const double *source, double *d);

struct lobe_balance {
    int n;                                           /* nodes: LOBE_BALANCE_N unless the caller sets fewer */
    double kernel[LOBE_BALANCE_N][LOBE_BALANCE_N];   /* g (constant + slope k), folded to u >= 0: symmetric */
    double d_kernel[LOBE_BALANCE_N][LOBE_BALANCE_N]; /* by beta */
    double weight[LOBE_BALANCE_N];                   /* cos^2 u du */
    double share[2 * LOBE_BALANCE_N];                /* k of half an angle of so many nodes; filled in by the caller */
    double want[LOBE_BALANCE_N], work[3 * LOBE_BALANCE_N], source[LOBE_BALANCE_N];
};

/* Fills in the weights of LOBE_BALANCE_N nodes; the share is 0. The functions that multiply and solve also serve other
 * nodes, whose number, weights and kernel the caller sets. */
void lobe_balance_init(struct lobe_balance *b);
/* Angle of node i, or of the distance of so many nodes. */
double lobe_balance_angle_rad(int i);
/* kernel = g(constant + slope share) for a lobe of width beta (rad), and its derivative by beta. */
void lobe_balance_fill_kernel(struct lobe_balance *b, double beta, double constant, double slope);
/* y_i = sum over j of m_ij weight_j x_j. */
void lobe_balance_multiply(const struct lobe_balance *b, double (*m)[LOBE_BALANCE_N], const double *x, double *y);
/* Finds the positive x with x_i (kernel x)_i = want_i. */
void lobe_balance_solve(struct lobe_balance *b, double *x);
/* Derivative of ln x from `source`, the derivative of ln want less x (d_kernel x) / want. */
void lobe_balance_solve_derivative(struct lobe_balance *b, const double *x, double *d);
/* source = -x (d_kernel x) / want: the kernel changes and want does not. */
void lobe_balance_source_of_kernel(struct lobe_balance *b, const double *x);

/* Solves for a, the scale of R: want = 1, no share. d_ln_a: by beta. */
void lobe_balance_r(struct lobe_balance *b, double beta, double *a, double *d_ln_a);
/* rho = a (g share) a: fraction of the light at each node that the share sends into R. d_rho: by beta. Leaves the
 * kernel g share.
 */
void lobe_balance_share(struct lobe_balance *b, double beta, const double *a, const double *d_ln_a, double *rho,
                        double *d_rho);

/* The value at entry i of a table of twice as many intervals. */
double lobe_balance_at_entry(const double *f, int i);

#endif
