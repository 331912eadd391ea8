#include "optimizer/photographs/camera/exposure_series.h"

#include <math.h>
#include <stdbool.h>

static const double same = 0.002; /* relative */

static bool is_listed(const double *list, size_t n, double v)
{
    for (size_t i = 0; i < n; i++)
        if (fabs(v / list[i] - 1.0) < same) return true;
    return false;
}

/* ln of the nearest value of 2^(k / a) or 2^(k / b) over v. */
static double to_series(double v, double a, double b)
{
    const double stop = log2(v), off_a = rint(stop * a) / a - stop, off_b = rint(stop * b) / b - stop;
    return M_LN2 * (fabs(off_a) <= fabs(off_b) ? off_a : off_b);
}

double exposure_time_rounding(double t)
{
    /* of thirds and halves of a stop, from 1/3 s on as 1 / time */
    static const double over[] = {3,    4,    5,    6,    8,    10,   13,   15,    20,    25,    30,   40,
                                  45,   50,   60,   80,   90,   100,  125,  160,   180,   200,   250,  320,
                                  350,  400,  500,  640,  750,  800,  1000, 1250,  1500,  1600,  2000, 2500,
                                  3000, 3200, 4000, 5000, 6000, 6400, 8000, 10000, 12800, 16000, 32000};
    static const double seconds[] = {0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1,  1.3, 1.5, 1.6, 2,  2.5, 3,
                                     3.2, 4,   5,   6,   8,   10,  13, 15,  20,  25,  30, 60};
    if (!(t > 0.0)) return 0.0;
    if (!is_listed(over, sizeof over / sizeof *over, 1.0 / t) &&
        !is_listed(seconds, sizeof seconds / sizeof *seconds, t))
        return 0.0;
    return to_series(t, 3.0, 2.0);
}

double exposure_aperture_rounding(double n)
{
    static const double number[] = {1,  1.1, 1.2, 1.4, 1.6, 1.7, 1.8, 2,   2.2, 2.4, 2.5, 2.8, 3.2, 3.3, 3.5,
                                    4,  4.5, 4.8, 5,   5.6, 6.3, 6.7, 7.1, 8,   9,   9.5, 10,  11,  13,  14,
                                    16, 18,  19,  20,  22,  25,  27,  29,  32,  36,  38,  40,  45,  64};
    if (!(n > 0.0) || !is_listed(number, sizeof number / sizeof *number, n)) return 0.0;
    return to_series(n, 6.0, 4.0); /* a stop is a factor of sqrt 2 */
}

double exposure_iso_rounding(double iso)
{
    static const double number[] = {50,   64,   70,   80,   100,  125,   140,   160,   200,   250,   280,   320,  400,
                                    500,  560,  640,  800,  1000, 1100,  1250,  1600,  2000,  2200,  2500,  3200, 4000,
                                    4500, 5000, 6400, 8000, 9000, 10000, 12800, 16000, 18000, 20000, 25600, 51200};
    if (!(iso > 0.0) || !is_listed(number, sizeof number / sizeof *number, iso)) return 0.0;
    return to_series(iso / 100.0, 3.0, 2.0);
}

void exposure_rounding_state(struct photograph_record *r, const struct exposure_reference *reference,
                             const double mean_rgb[3], double se_rgb[3])
{
    const double time = exposure_time_rounding(r->scale_s) - exposure_time_rounding(reference->time_s);
    const double aperture =
        exposure_aperture_rounding(reference->aperture) - exposure_aperture_rounding(r->info.aperture);
    const double iso = exposure_iso_rounding(r->info.iso) - exposure_iso_rounding(reference->iso);
    for (size_t c = 0; c < 3; c++) {
        double *error = r->color_error[c];
        error[PHOTOGRAPH_TIME_CAUSE] = time * mean_rgb[c];
        error[PHOTOGRAPH_APERTURE_CAUSE] = 2.0 * aperture * mean_rgb[c];
        error[PHOTOGRAPH_ISO_CAUSE] = iso * mean_rgb[c];
        for (size_t k = PHOTOGRAPH_TIME_CAUSE; k < PHOTOGRAPH_CAUSES; k++) se_rgb[c] = hypot(se_rgb[c], error[k]);
    }
}
