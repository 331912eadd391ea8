#include "geometry/volume/format/axis_directions.h"

#include <math.h>
#include <string.h>

/* Sine of the angle from which on an axis is oblique. */
static const double MOST_SINE = 1e-3;

bool axis_directions_name(double direction[3][3], char axes[8])
{
    char letter[3] = {0, 0, 0};
    bool reversed[3] = {false, false, false};
    axes[0] = '\0';
    for (int a = 0; a < 3; a++) {
        const double *d = direction[a], length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        int along = 0;
        for (int w = 1; w < 3; w++)
            if (fabs(d[w]) > fabs(d[along])) along = w;
        for (int w = 0; w < 3; w++)
            if (w != along && !(fabs(d[w]) <= MOST_SINE * length)) return false;
        if (letter[along] != 0) return false;
        letter[along] = "xyz"[a];
        reversed[along] = d[along] < 0.0;
    }
    for (int w = 0; w < 3; w++) {
        if (reversed[w]) *axes++ = '-';
        *axes++ = letter[w];
    }
    *axes = '\0';
    return true;
}

bool axes_are_mirrored(const char *axes)
{
    char letter[3] = {0, 0, 0};
    int n = 0;
    bool mirrored = false;
    for (const char *c = axes; *c != '\0' && n < 3; c++)
        if (*c == '-')
            mirrored = !mirrored;
        else if (*c != '+')
            letter[n++] = *c;
    for (int a = 0; a < 3; a++)
        for (int b = a + 1; b < 3; b++)
            if (letter[a] > letter[b]) mirrored = !mirrored;
    return mirrored;
}
