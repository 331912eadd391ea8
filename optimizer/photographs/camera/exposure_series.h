/* The rounding of exposure times, f-numbers and ISO values that cameras state.
 *
 * Shutter times, apertures and ISO values follow series of powers of 2 in thirds or halves of a stop (ISO 516, ISO
 * 517, ISO 12232), and cameras show rounded numbers: "1/60 s" is 1/64 s, "f/11" is f/11.31, "ISO 1250" is 1269.9.
 * Whether a camera means the number or the series is not known, so the difference is an error of one standard
 * deviation. It is one cause for all photographs of a camera: times (or apertures, or ISO values) are those of the
 * series together, or none is. */
#ifndef SELVEDGE_OPTIMIZER_EXPOSURE_SERIES_H
#define SELVEDGE_OPTIMIZER_EXPOSURE_SERIES_H

#include "optimizer/photographs/reader/photograph.h"

/* The exposure that absolute values belong to: of the chart or white reference, or of the first photograph. */
struct exposure_reference {
    double time_s, aperture, iso; /* NaN: not stated */
};

/* ln of the series' value over the stated one; 0 for values that no series is rounded to, and for NaN. */
double exposure_time_rounding(double time_s);
double exposure_aperture_rounding(double f_number);
double exposure_iso_rounding(double iso);

/* States the errors of a mean by the rounding of its exposure against the reference, as the shared causes
 * PHOTOGRAPH_TIME_CAUSE, PHOTOGRAPH_APERTURE_CAUSE and PHOTOGRAPH_ISO_CAUSE of r->color_error, and adds them to
 * se_rgb. */
void exposure_rounding_state(struct photograph_record *r, const struct exposure_reference *reference,
                             const double mean_rgb[3], double se_rgb[3]);

#endif
