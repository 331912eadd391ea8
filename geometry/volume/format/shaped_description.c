/* The description that tifffile writes, {"shape": [12, 40, 32]}, and the choice among all kinds of descriptions. */
#include "geometry/volume/format/tiff_description.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_SHAPE = 8 };

/* Reads the numbers of the list after "shape". Returns how many there are; 0: none. */
static int read_shape(const char *text, size_t shape[MAX_SHAPE])
{
    const char *p = strstr(text, "\"shape\"");
    int n = 0;
    p = p != NULL ? strchr(p, '[') : NULL;
    if (p == NULL) return 0;
    while (*p != ']' && n < MAX_SHAPE) {
        char *end;
        const unsigned long long v = strtoull(p + 1, &end, 10);
        if (end == p + 1) return 0;
        shape[n++] = (size_t)v;
        p = end + strspn(end, " \t\r\n");
        if (*p != ',' && *p != ']') return 0;
    }
    return *p == ']' ? n : 0;
}

/* Returns the dimension of a letter of "axes", or else, for leading dimensions without a name, the next free one of
 * slices, channels, times. */
static int dimension_of(char letter, const struct tiff_description *d)
{
    static const int unnamed[] = {TIFF_SLICES, TIFF_CHANNELS, TIFF_TIMES};
    if (letter == 'C') return TIFF_CHANNELS;
    if (letter == 'Z') return TIFF_SLICES;
    if (letter == 'T') return TIFF_TIMES;
    for (int i = 0; i < TIFF_DIMENSIONS; i++)
        if (d->n[unnamed[i]] == 0) return unnamed[i];
    return -1;
}

/* A description {"shape": [2, 12, 40, 32], "axes": "CZYX", "truncated": true}: the slowest dimension first. */
static bool shaped_description_read(const char *text, struct tiff_description *d)
{
    size_t shape[MAX_SHAPE];
    const int n = text[0] == '{' ? read_shape(text, shape) : 0;
    const char *axes = strstr(text, "\"axes\"");
    axes = n > 0 && axes != NULL ? strchr(axes + 6, '"') : NULL;
    if (axes != NULL && strcspn(axes + 1, "\"") != (size_t)n) axes = NULL;
    if (n < 3) return false;
    const bool of_pixels = axes != NULL && axes[n] != 'X'; /* samples of a pixel come last */
    int n_order = 0;
    for (int i = n - 3 - of_pixels; i >= 0; i--) {
        const int k = dimension_of(axes != NULL ? axes[1 + i] : '?', d);
        if (shape[i] == 1 && i > 0) continue;
        if (k < 0 || d->n[k] > 0 || shape[i] == 0) return false;
        d->n[k] = shape[i];
        d->order[n_order++] = k;
    }
    for (int k = 0; k < TIFF_DIMENSIONS; k++)
        if (d->n[k] == 0) {
            d->n[k] = 1;
            d->order[n_order++] = k;
        }
    d->source = "the file's description (\"shape\")";
    d->may_follow = strstr(text, "\"truncated\"") != NULL;
    return true;
}

status tiff_description_read(const char *text, const double px_per_unit[2], const char *name,
                             struct tiff_description *d, struct volume_source_info *info, struct error *err)
{
    *d = (struct tiff_description){0};
    if (text == NULL || imagej_description_read(text, px_per_unit, d, info)) return STATUS_OK;
    if (shaped_description_read(text, d)) return STATUS_OK;
    *d = (struct tiff_description){0};
    return ome_description_read(text, name, d, info, err);
}
