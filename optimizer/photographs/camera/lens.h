/* Errors of a lens: fall-off of light towards the corners, and distortion. Both are functions of the place in the
 * picture as it is read (of a Bayer sensor: in cells of 2 x 2 samples).
 *
 * Vignetting: a pixel at the distance r (over radius_px) from the center has the share 1 + a1 r^2 + a2 r^4 + a3 r^6 of
 * the light in the center. Distortion: the model of Brown (1966) as OpenCV writes it, from the ideal to the real place;
 * with x = (u - c_x) / f_x, y likewise, R = x^2 + y^2: x' = x (1 + k1 R + k2 R^2 + k3 R^3) + 2 p1 x y + p2 (R + 2 x^2),
 * y' = y (...) + p1 (R + 2 y^2) + 2 p2 x y.
 */
#ifndef SELVEDGE_OPTIMIZER_LENS_H
#define SELVEDGE_OPTIMIZER_LENS_H

#include "base/status.h"
#include "renderer/image/image.h"

#include <stdbool.h>

struct lens {
    bool has_vignetting, has_distortion;
    double vignetting_center_px[2], vignetting_radius_px, vignetting[3];
    double focal_px[2], center_px[2], k[3], p[2];
};

/* Where a point of the corrected picture lies in the picture as it was taken. */
void lens_distort(const struct lens *l, const double ideal_px[2], double real_px[2]);
/* The opposite, by fixed-point iteration. */
void lens_undistort(const struct lens *l, const double real_px[2], double ideal_px[2]);
/* Share of the light that a pixel has at a place of the picture as it was taken; at least 0.01. */
double lens_vignetting(const struct lens *l, const double real_px[2]);
/* The crop x0, y0, x1, y1 (all 0: everything) of the corrected picture, by bilinear interpolation where the lens has
 * distortion or the crop does not begin and end with pixels: it then has the next whole number of them a side. im is
 * replaced. STATUS_INVALID when the crop reaches places that the picture does not show. */
status lens_correct(const struct lens *l, const double crop[4], struct image *im, struct error *err);
/* The same for the variances of the pixels of a picture before its correction. Interpolation spreads the noise of a
 * pixel over its neighbours: each value is the density of variance there, so that the sum over an area is the variance
 * of the sum of the corrected picture over the area, though single pixels of the corrected picture are quieter. */
status lens_correct_variance(const struct lens *l, const double crop[4], struct image *variance, struct error *err);

#endif
