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

enum { WAVE_LEAF = LANES, WAVE_MOST_LEVEL = 10 };
/* Gathered vectors: a window of 60 kernels from its middle to its edge touches 17 x 17 leaves. */
enum { WAVE_MOST_RADIUS = 60, WAVE_MOST_VECTOR = 17 * 17 * WAVE_LEAF };

/* Eight kernels of a row of a leaf. */
struct wave_row {
    lanes height_um, slope_u, slope_v, gain;
};

/* Ranges of the slopes along u and v: low u, high u, low v, high v. */
struct wave_range {
    float low_u, high_u, low_v, high_v;
};

struct wave_tree {
    size_t n, n_level;       /* kernels along a side; level 0 are the leaves, the last one is the tile */
    float step_um, first_um; /* l; place of kernel 0 */
    struct wave_row *row;    /* of leaf (i, j), row r: ((j n / 8) + i) 8 + r */
    struct wave_range *range[WAVE_MOST_LEVEL];
};

/* The middle and the standard deviation of the window exp(-r^2 / (2 sd^2)), which ends at 3 sd. 3 sd_um are at most
 * WAVE_MOST_RADIUS kernels. */
struct wave_window {
    double center_um[2], sd_um;
};

/* psi: sum of both directions on the surface; xi_3: as in wave_diffraction.h; reach: kernels whose |xi_3 H' + psi| is
 * beyond it are dropped, INFINITY keeps all. growth: xi_3^2, or 0 to leave out the gain of the field. */
struct wave_direction {
    float psi[2], xi_3, reach, growth;
};

/* Kernels of a query. path_um: xi_3 H + psi . (m - center), wavelengths of phase times lambda. bend: |xi_3 H' + psi|^2,
 * less growth times the gain of the field. * weight: of the window, 0 for kernels that are dropped. tilt: psi . H'. */
struct wave_gathered {
    size_t n; /* vectors */
    lanes path_um[WAVE_MOST_VECTOR], bend[WAVE_MOST_VECTOR], weight[WAVE_MOST_VECTOR], tilt[WAVE_MOST_VECTOR];
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
