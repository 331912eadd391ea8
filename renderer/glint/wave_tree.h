/* Gabor kernels of a height field (wave_height.h), one for each texel or for each second one and so on, with a
 * hierarchy over their places and directions from which the kernels of a query are gathered.
 *
 * Kernel k has its middle at m_k and the standard deviation sigma = l / 2 of the distance l. Its Fourier transform is a
 * Gaussian about the direction psi = -xi_3 H'_k with the standard deviation lambda / (2 pi sigma) (equations 3.27 to
 * 3.35 of the fur and glints thesis). A query keeps the kernels within 3 standard deviations of the coherence window in
 * place and 3 of its own in direction, at the longest wavelength. Nodes are squares of kernels with the range of their
 * slopes, as a mipmap; the square itself is the box of their places.
 *
 * Frame: u and v on the surface in um, the tile repeats. Immutable after its init; threads share it. */
#ifndef SELVEDGE_RENDERER_WAVE_TREE_H
#define SELVEDGE_RENDERER_WAVE_TREE_H

#include "base/lanes.h"
#include "renderer/glint/wave_height.h"

#include <stdbool.h>

enum { WAVE_LEAF = LANES, WAVE_MOST_LEVEL = 10 };
/* Gathered vectors: a window of 60 kernels from its middle to its edge touches 17 x 17 leaves; one more ends them. */
enum { WAVE_MOST_RADIUS = 60, WAVE_MOST_VECTOR = 17 * 17 * WAVE_LEAF + 1 };

/* Eight kernels of a row of a leaf. most2: the square of the larger principal curvature; third2: of wave_height.h,
 * times sigma^6. */
struct wave_row {
    lanes height_um, slope_u, slope_v, curve_uu, curve_uv, curve_vv, most2, third2;
};

/* Ranges of the slopes along u and v, and the largest most2. */
struct wave_range {
    float low_u, high_u, low_v, high_v, most2;
};

struct wave_tree {
    size_t n, n_level;       /* kernels along a side; level 0 are the leaves, the last one is the tile */
    bool is_curved;          /* kernels follow the curvature of the surface */
    float step_um, first_um; /* l; place of kernel 0 */
    struct wave_row *row;    /* of leaf (i, j), row r: ((j n / 8) + i) 8 + r */
    struct wave_range *range[WAVE_MOST_LEVEL];
};

/* The middle and the standard deviation of the window exp(-r^2 / (2 sd^2)), which ends at 3 sd. 3 sd_um are at most
 * WAVE_MOST_RADIUS kernels. */
struct wave_window {
    double center_um[2], sd_um;
};

/* psi: sum of both directions on the surface; xi_3: as in wave_diffraction.h. Kernels with |xi_3 H' + psi|^2 >
 * reach2 + widening most2 are dropped: a curved kernel reaches as much farther. reach2 = INFINITY keeps all. */
struct wave_direction {
    float psi[2], xi_3, reach2, widening;
};

/* Kernels of a query, with b = xi_3 H' + psi and the curvature K = xi_3 H''. path_um: xi_3 H + psi . (m - center),
 * wavelengths of phase times lambda. bend: |b|^2. weight: of the window. tilt:
 * psi . H'. trace, det: of K; across: b_u^2 K_vv - 2 b_u b_v K_uv + b_v^2 K_uu; third2: times xi_3^2. These are not
 * filled in for flat kernels. */
struct wave_gathered {
    size_t n; /* vectors; the last one may end with kernels of the weight 0 */
    lanes path_um[WAVE_MOST_VECTOR], bend[WAVE_MOST_VECTOR], weight[WAVE_MOST_VECTOR], tilt[WAVE_MOST_VECTOR];
    lanes trace[WAVE_MOST_VECTOR], det[WAVE_MOST_VECTOR], across[WAVE_MOST_VECTOR], third2[WAVE_MOST_VECTOR];
};

/* Copies every stride-th texel of every stride-th row. stride: a power of two, at most n / 8. STATUS_NO_MEMORY. */
status wave_tree_init(struct wave_tree *t, const struct wave_height *h, size_t stride, struct error *err);
void wave_tree_release(struct wave_tree *t);
/* Fills in the kernels of a window that reach a direction. */
void wave_tree_gather(const struct wave_tree *t, const struct wave_window *w, const struct wave_direction *d,
                      struct wave_gathered *g);
/* Slopes at the kernel that is nearest to a place. */
void wave_tree_slope(const struct wave_tree *t, const double place_um[2], float slope[2]);

#endif
