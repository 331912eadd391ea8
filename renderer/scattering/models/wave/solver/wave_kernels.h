/* Nodes on an outline and the kernels of boundary integrals between them, for the solvers of this folder.
 *
 * A node stands at each of n equidistant values of the outline's parameter t. The single layer S, the double layer D,
 * its transpose D' and the derivative T of the double layer are integrated over t by the quadrature of Kussmaul and
 * Martensen (Kress 2014, "Linear Integral Equations", section 12.3), which is exact for the logarithm in the kernels.
 * Wave numbers are per unit of length of the outline.
 */
#ifndef SELVEDGE_RENDERER_WAVE_KERNELS_H
#define SELVEDGE_RENDERER_WAVE_KERNELS_H

#include "renderer/scattering/models/wave/solver/wave_outline.h"

enum { WAVE_MOST_NODE = 16384 };

struct wave_node {
    double complex at, normal; /* x + i y; outward unit normal */
    double speed, curvature;   /* |dx / dt|, positive where convex */
};

struct wave_nodes {
    size_t n;
    double step;
    struct wave_node *node;
    double *log_weight; /* of a kernel's logarithmic part, by the distance in nodes */
};

/* STATUS_NO_MEMORY. */
status wave_nodes_init(struct wave_nodes *w, const struct wave_outline *o, size_t n, struct error *err);
void wave_nodes_release(struct wave_nodes *w);

/* The kernels of one medium from a source to a target, times weights but not times the speed of the source. */
struct wave_kernels {
    double complex single, twice, twice_prime, slope; /* S, D, D', T */
};
/* From node j to another node i; the kernels from i to j are the same with D and D' exchanged. */
struct wave_kernels wave_kernels_between(const struct wave_nodes *w, double complex k, size_t i, size_t j);
/* The limits at a node. D and D' have the limits of Laplace's equation, the same in all media; T is without its
 * strongest singularity, which cancels between two media. */
struct wave_kernels wave_kernels_at(const struct wave_nodes *w, double complex k, size_t i);

/* STATUS_INVALID with the field "k", "index", "n_node" for problems that no solver takes. k: wave number outside;
 * k_inside: of the material. */
status wave_check_problem(const struct wave_outline *o, double k, double complex index, size_t n_node,
                          struct error *err);

static inline double wave_dot(double complex a, double complex b) { return creal(conj(a) * b); }
/* Unit vector towards an angle from the x axis. */
double complex wave_direction(double angle_rad);

/* Parts of solutions, each a column of the values u of all nodes, then v / k. */
struct wave_columns {
    const double *re, *im;
    size_t stride, n; /* distance of the rows; columns */
};
/* Amplitudes T of all columns towards an angle; wave_solver.h defines them. */
void wave_nodes_towards(const struct wave_nodes *w, double k, double angle_rad, const struct wave_columns *c,
                        double complex *t);
/* Returns the flux of one column into the fiber, as a cross-section. */
double wave_nodes_absorption(const struct wave_nodes *w, const struct wave_columns *c, size_t column);

#endif
