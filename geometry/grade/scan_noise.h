/* How the noise of neighbouring voxels is correlated, measured in the void of a scan. A scanner's filter correlates
 * noise, and correlated noise looks like thin fibers. */
#ifndef SELVEDGE_GEOMETRY_SCAN_NOISE_H
#define SELVEDGE_GEOMETRY_SCAN_NOISE_H

#include "geometry/volume/volume.h"

/* Returns the correlation coefficient of neighbours along an axis, mean over the axes. v: densities in [0, 1], whose
 * noise has the standard deviation noise_sd about 0 in void. Clamping at 0 hides half of the noise; for Gaussian noise
 * of correlation c the positive part has E[max(0,x) max(0,y)] / E[max(0,x)^2] = (sqrt(1 - c^2) + c (pi - acos c)) / pi
 * (Cho and Saul 2009, kernel of order 1), which is inverted. NaN if the scan has too little void, or no noise. */
double scan_noise_correlation(const struct volume *v, double noise_sd);
/* Standard deviation in voxels of the sampled Gaussian that gives white noise this correlation, at most 5; 0 for 0.02
 * and less, and for NaN. */
double scan_noise_blur(double correlation);

#endif
