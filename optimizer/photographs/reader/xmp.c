#include "optimizer/photographs/reader/xmp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BYTES = 1 << 20 };

/* The value of a property, a number or a fraction; NaN where the text has none. */
static double property(const char *text, const char *name)
{
    const char *p = strstr(text, name);
    if (p == NULL) return NAN;
    p += strlen(name);
    if (*p != '=' && *p != '>' && *p != ' ') return NAN; /* a longer name */
    for (;;) {
        p += strspn(p, " \t\r\n=\"'>");
        if (*p != '<' || p[1] == '/') break;
        p += strcspn(p, ">"); /* a list and its items */
    }
    char *end;
    double value = strtod(p, &end);
    if (end == p) return NAN;
    if (*end == '/') value /= strtod(end + 1, NULL);
    return isfinite(value) ? value : NAN;
}

static void set_positive(double *to, double value)
{
    if (isnan(*to) && value > 0.0 && value < 1e9) *to = value;
}

void xmp_read(const void *packet, size_t n_bytes, struct photograph_info *info)
{
    char *text = n_bytes <= MOST_BYTES ? malloc(n_bytes + 1) : NULL;
    if (text == NULL) return;
    memcpy(text, packet, n_bytes);
    text[n_bytes] = '\0';
    set_positive(&info->exposure_s, property(text, "exif:ExposureTime"));
    set_positive(&info->exposure_s, exp2(-property(text, "exif:ShutterSpeedValue")));
    set_positive(&info->aperture, property(text, "exif:FNumber"));
    set_positive(&info->aperture, exp2(0.5 * property(text, "exif:ApertureValue")));
    set_positive(&info->iso, property(text, "exifEX:PhotographicSensitivity"));
    set_positive(&info->iso, property(text, "exif:ISOSpeedRatings"));
    const double orientation = property(text, "tiff:Orientation");
    if (info->orientation == 0 && orientation >= 1.0 && orientation <= 8.0) info->orientation = (unsigned)orientation;
    free(text);
}
