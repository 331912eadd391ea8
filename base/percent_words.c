#include "base/percent_words.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>

enum { DECIMALS_MOST = 6 };

/* Returns the decimals with which x > 0 has n significant digits, 0 to DECIMALS_MOST. */
static int decimals_of(double x, int n)
{
    const double wanted = n - 1 - floor(log10(x));
    return wanted < 0.0 ? 0 : wanted > DECIMALS_MOST ? DECIMALS_MOST : (int)wanted;
}

/* Writes the bound of a share that noise hides; false if the share is above the noise. */
static bool put_below(double share, double se, char out[PERCENT_WORDS_BYTES])
{
    if (!(se > 0.0) || !isfinite(se) || share >= 2.0 * se) return false;
    const double bound = 100.0 * (share + 2.0 * se);
    if (!(bound > 0.0)) return false;
    const double unit = pow(10.0, floor(log10(bound)) - 1.0);
    /* a bound that has two digits already is not raised by its rounding in binary */
    const double up = unit * ceil(bound / unit - 1e-9);
    snprintf(out, PERCENT_WORDS_BYTES, "below %.*f %%", decimals_of(up * (1.0 + 1e-12), 2), up);
    return true;
}

static void put(double share, double se, bool with_se, char out[PERCENT_WORDS_BYTES])
{
    const double percent = 100.0 * share, percent_se = 100.0 * se;
    if (!isfinite(share))
        snprintf(out, PERCENT_WORDS_BYTES, "-");
    else if (!(se > 0.0) || !isfinite(se))
        snprintf(out, PERCENT_WORDS_BYTES, "%.3g %%", percent);
    else if (!put_below(share, se, out)) {
        /* one digit of the standard error, two if it begins with 1 */
        const int first = decimals_of(percent_se, 1);
        const int n = percent_se * pow(10.0, first) < 1.95 && percent_se < 10.0 ? first + 1 : first;
        if (with_se)
            snprintf(out, PERCENT_WORDS_BYTES, "%.*f +- %.*f %%", n, percent, n, percent_se);
        else
            snprintf(out, PERCENT_WORDS_BYTES, "%.*f %%", n, percent);
    }
}

void percent_words(double share, double se, char out[PERCENT_WORDS_BYTES]) { put(share, se, true, out); }

void percent_words_short(double share, double se, char out[PERCENT_WORDS_BYTES]) { put(share, se, false, out); }
