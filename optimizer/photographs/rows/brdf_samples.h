/* A BRDF known at scattered pairs of directions, as a goniometer measures them, and its values between them.
 *
 * A pair (l, c) towards lamp and camera is the vectors a = l + c and b = 0.15 (l - c): along a, which is the half
 * vector, a BRDF changes fast, along b slowly. The squared distance of two pairs is the sum of both squared
 * differences. Exchange of l and c changes the sign of b alone, and by reciprocity nothing else. An isotropic BRDF is
 * the same for pairs that are turned about the normal, or mirrored; the nearest of them counts. A value lies on a plane
 * through the nearest 16 samples, fitted by weighted least squares (weights fall to 0 at the next sample), and stays
 * between the least and the largest of them; at a sample it is that sample. */
#ifndef SELVEDGE_OPTIMIZER_BRDF_SAMPLES_H
#define SELVEDGE_OPTIMIZER_BRDF_SAMPLES_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

struct brdf_sample {
    double light[3], camera[3]; /* unit vectors, z along the normal */
    double f_rgb[3];            /* per steradian */
};

struct brdf_samples {
    size_t n;
    bool isotropic;
    struct brdf_sample *item; /* sorted by brdf_samples_sort: light[2] + camera[2] rises */
};

/* To be called once before the functions below. */
void brdf_samples_sort(struct brdf_samples *s);
/* Distance of two pairs, as above. */
double brdf_samples_distance(bool isotropic, const struct brdf_sample *p, const struct brdf_sample *q);
/* False where l + c of the nearest sample is more than 0.2 away (about 6 degrees of the half vector), or its l - c more
 * than 0.8 (23 degrees of each direction). */
bool brdf_samples_value(const struct brdf_samples *s, const double light[3], const double camera[3], double f_rgb[3]);
/* Chooses at most n_wanted samples that spread over all: first the one that is nearest to `first`, then always the one
 * that is farthest from those chosen. Only samples with both directions within 80 degrees of the normal count. Returns
 * their number. */
size_t brdf_samples_spread(const struct brdf_samples *s, const struct brdf_sample *first, size_t n_wanted,
                           size_t *chosen);

#endif
