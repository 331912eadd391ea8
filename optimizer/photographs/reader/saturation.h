/* The value at which a picture is clipped, found in the picture.
 *
 * A sensor or program that clips puts the whole upper tail of a channel's distribution on its largest value, whatever
 * the container: 4095 for 12 bits in 16, 65520 where they are shifted. Let n be the number of samples at the largest
 * value M of a channel and c the largest count of any of the NEAR (16) next smaller values that occur. The channel is
 * clipped where
 *   - n is at least 16 and 0.5 % of the samples: fewer would neither be refused nor matter;
 *   - n > FACTOR (8) c + 5 sqrt(FACTOR c): the densities of noise fall towards their end, so that n <= c is expected,
 *     and even a noiseless hump 1 - |x|^p, rounded to values, has n < 5.3 c for p <= 4;
 *   - the distribution reaches M without a gap: NEAR or more values lie in the upper half, and the step to M is at most
 *     8 times the mean step between them. Where steps are independent, a larger one has a probability of
 *     (1 + 8/16)^-16 = 0.0015. A flat background brighter than everything else leaves a gap;
 *   - no value between 5 % and M has such a pile and a quarter of n. A synthetic picture of flat areas has several.
 * A picture of 16 bits whose largest value is that of 10, 12 or 14 bits, shifted or not, needs the first condition
 * alone. */
#ifndef SELVEDGE_OPTIMIZER_SATURATION_H
#define SELVEDGE_OPTIMIZER_SATURATION_H

#include "optimizer/photographs/reader/photograph_info.h"
#include "renderer/image/image.h"

/* Lowers info->saturation to the piles that the picture has, and enters them into the ledger as "largest value". Does
 * nothing without memory. */
void saturation_find(const struct image *im, struct photograph_info *info);

#endif
