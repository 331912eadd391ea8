/* Gaussian elements: the position-normal distribution of a map as a sum of Gaussians over (u, v, s, t)
 * (000, section 3.8).
 *
 * Element i stands for h^2 of the surface around u_i, h the distance of elements: with sigma_h = h / sqrt(8 ln 2),
 *
 *     G_i(u, s) = h^2 N(u - u_i; sigma_h^2 I) N(s - s_i - J (u - u_i); sigma_r^2 I)          equations 3.24 to 3.26
 *
 * where N is a normalised Gaussian, s_i the normal at u_i, and J its Jacobian (0: a flat element). The footprint
 * N(u - p; P) times G_i, integrated over u, is (appendix A in another form, with C = P + sigma_h^2 I, d = p - u_i)
 *
 *     h^2 N(d; C) N(s - s_i - J K d; sigma_r^2 I + J S J^T),   K = sigma_h^2 C^-1,   S = sigma_h^2 P C^-1
 *
 * Their sum over i at any place is 1 but for a ripple of 6 %, which the footprint smooths (glint_query.total). Lengths
 * are in micrometres. */
#ifndef SELVEDGE_RENDERER_GLINT_ELEMENT_H
#define SELVEDGE_RENDERER_GLINT_ELEMENT_H

#include "base/lanes.h"
#include "renderer/glint/glint_map.h"

/* Two rows of four floats, so that eight elements become eight vectors. */
struct glint_element {
    float place_um[2], normal[2];
    float jacobian[4]; /* d s / d u, d s / d v, d t / d u, d t / d v, for a micrometre */
};

/* Elements lie on a square lattice of n x n; element (i, j) is at ((i + 1/2) h, (j + 1/2) h). They are stored by tiles,
 * so that a square of them lies in few pages of memory. */
enum { GLINT_TILE = 16 };
struct glint_lattice {
    size_t n;
    float step_um, period_um;
    float variance_h, variance_r; /* sigma_h^2 in um^2, sigma_r^2 */
    struct glint_element *element;
};

/* Index of element (i, j). */
static inline size_t glint_lattice_index(const struct glint_lattice *l, size_t i, size_t j)
{
    return (j / GLINT_TILE * (l->n / GLINT_TILE) + i / GLINT_TILE) * (GLINT_TILE * GLINT_TILE) +
           j % GLINT_TILE * GLINT_TILE + i % GLINT_TILE;
}

/* Standard deviations beyond which a Gaussian counts as 0. */
#define GLINT_REACH 4.0F

/* STATUS_NO_MEMORY. */
status glint_lattice_make(const struct glint_option *o, const struct glint_map *m, struct glint_lattice *l,
                          struct error *err);
void glint_lattice_release(struct glint_lattice *l);

/* Numbers that all elements under one footprint share. Symmetric matrices are uu, uv, vv. */
struct glint_query {
    float center_um[2];
    float wide[3], inverse[3]; /* C and its inverse, um^2 */
    float gain[3], narrow[3];  /* K; S in um^2 */
    float variance_r;
    float factor; /* h^2 / ((2 pi)^2 sqrt(det C)), divided by the sum of the elements' weights */
};
void glint_query_init(const struct glint_lattice *l, const struct glint_footprint *at, struct glint_query *q);

/* Sum of density / q->factor of n elements at the normal half; index: of elements. shift_um: added to their
 * places. */
float glint_query_sum(const struct glint_query *q, const struct glint_element *element, const uint32_t *index, size_t n,
                      const float shift_um[2], const float half[2]);

/* Mean and covariance (ss, st, tt) of the normals that element e shows the footprint, d = p - u_i. */
void glint_query_normal(const struct glint_query *q, const struct glint_element *e, const float d[2], float mean[2],
                        float covariance[3]);

#endif
