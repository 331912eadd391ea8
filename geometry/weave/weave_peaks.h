/* Peaks in the power spectrum of a photograph: the frequencies at which it repeats. Frequencies are in cycles per
 * pixel, x to the right and y down the picture. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_PEAKS_H
#define SELVEDGE_GEOMETRY_WEAVE_PEAKS_H

#include "base/status.h"

enum { WEAVE_PEAK_MAX = 64 };

struct weave_peak {
    double f[2];   /* f[1] >= 0: a peak and its mirror image are one */
    double power;  /* sum over the peak's bins, background taken off */
    double excess; /* largest bin over the background */
};

/* Finds the strongest peaks of a spectrum as vision_spectrum makes it, strongest first. A peak stands out of the
 * background at least 12 times; in noise without texture the highest of 10^5 bins reaches about 5. Peaks nearer to zero
 * than 5 periods in the picture are left out: light and folds are there. STATUS_NO_MEMORY. */
status weave_find_peaks(const float *power, const float *background, size_t width, size_t height,
                        struct weave_peak peak[WEAVE_PEAK_MAX], size_t *n_peak, struct error *err);

#endif
