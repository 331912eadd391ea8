/* Outlines of a fiber's section as closed smooth curves, run through counter-clockwise: x(t) + i y(t) is a Fourier
 * series in t, and one turn of t runs through the outline.
 *
 * Lengths are in any unit; waves are stated by their number per unit. Sections are centered: the series has no
 * constant.
 */
#ifndef SELVEDGE_RENDERER_WAVE_OUTLINE_H
#define SELVEDGE_RENDERER_WAVE_OUTLINE_H

#include "base/rng.h"
#include "base/status.h"

#include <complex.h>
#include <stddef.h>

enum { WAVE_OUTLINE_MAX = 64 }; /* waves of either sign */

struct wave_outline {
    int n_wave;
    double complex forward[WAVE_OUTLINE_MAX + 1], backward[WAVE_OUTLINE_MAX + 1]; /* of exp(i k t), exp(-i k t) */
};

/* Half axes along x and y. */
void wave_outline_ellipse(struct wave_outline *o, double a, double b);
/* An ellipse whose long axis x is bent to a parabola, as of cotton: y moves by bean (x^2 / a - a / 4), the section of
 * geometry/phantom/phantom_section.h. bean in [0, 0.5]. */
void wave_outline_bean(struct wave_outline *o, double a, double b, double bean);
/* Radius (1 + depth cos(n_lobe t)): trilobal polyester, rounded triangles. depth in [0, 1). */
void wave_outline_lobed(struct wave_outline *o, double radius, int n_lobe, double depth);
/* The smooth curve of n_wave waves nearest to a closed polygon of n points, xy[2 i], xy[2 i + 1], in either sense:
 * series of the place by the length along the polygon, each wave weighted by Lanczos' factor, which rounds corners and
 * leaves no ripples. STATUS_INVALID, field "points", for fewer than 3 points, a point that is not finite, a polygon
 * without area, or one that meets itself. */
status wave_outline_from_points(struct wave_outline *o, const double *xy, size_t n, int n_wave, struct error *err);
/* Such a polygon from a file of lines "x,y"; empty lines and lines that begin with # are skipped. STATUS_NOT_FOUND,
 * STATUS_IO, STATUS_INVALID with the line. */
status wave_outline_load(struct wave_outline *o, const char *path, int n_wave, struct error *err);

/* A rough surface: moves the outline along its normal by a random height with a normal distribution, the standard
 * deviation height_sd, and the correlation exp(-(distance / length)^2) along the outline; the root mean square of its
 * slope is sqrt(2) height_sd / length. The series then has WAVE_OUTLINE_MAX waves; the roughness has those that a turn
 * of so many resolves. */
void wave_outline_roughen(struct wave_outline *o, double height_sd, double length, struct rng *rng);

void wave_outline_scale(struct wave_outline *o, double factor);
/* Turns the outline clockwise by a quarter of a turn, so that t = 0 is where t = pi / 2 was. */
void wave_outline_turn_quarter(struct wave_outline *o);

/* Place at t, and its first and second derivatives by t when not NULL. */
double complex wave_outline_at(const struct wave_outline *o, double t, double complex *first, double complex *second);
double wave_outline_area(const struct wave_outline *o);
double wave_outline_length(const struct wave_outline *o);
/* Least and largest extent across a direction of travel: range of the component along its left normal. */
void wave_outline_extent(const struct wave_outline *o, double angle_rad, double range[2]);
/* STATUS_INVALID when the curve meets itself or does not run counter-clockwise. */
status wave_outline_check(const struct wave_outline *o, struct error *err);

#endif
