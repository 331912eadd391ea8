#include "geometry/volume/format/length_unit.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const struct {
    const char *name;
    double metre;
} unit[] = {
    {"um", 1e-6},         {"micron", 1e-6},      {"microns", 1e-6},   {"micrometer", 1e-6}, {"micrometers", 1e-6},
    {"micrometre", 1e-6}, {"micrometres", 1e-6}, {"\xc2\xb5m", 1e-6}, {"\xce\xbcm", 1e-6},  {"\xb5m", 1e-6},
    {"\\u00b5m", 1e-6},   {"\\u03bcm", 1e-6},    {"mm", 1e-3},        {"millimeter", 1e-3}, {"millimeters", 1e-3},
    {"millimetre", 1e-3}, {"millimetres", 1e-3}, {"nm", 1e-9},        {"nanometer", 1e-9},  {"nanometers", 1e-9},
    {"nanometre", 1e-9},  {"nanometres", 1e-9},  {"cm", 1e-2},        {"centimeter", 1e-2}, {"centimeters", 1e-2},
    {"centimetre", 1e-2}, {"centimetres", 1e-2}, {"m", 1.0},          {"meter", 1.0},       {"meters", 1.0},
    {"metre", 1.0},       {"metres", 1.0},       {"inch", 0.0254},    {"inches", 0.0254},   {"in", 0.0254},
    {"\xc3\x85", 1e-10},  {"angstrom", 1e-10},
};

double length_unit_m(const char *text, size_t n)
{
    for (size_t i = 0; i < sizeof unit / sizeof *unit; i++)
        if (strlen(unit[i].name) == n && strncasecmp(unit[i].name, text, n) == 0) return unit[i].metre;
    return NAN;
}

void volume_state_voxel_size(struct volume_source_info *info, const double edge_m[3], const char *source)
{
    double stated_m = NAN, size_m[3];
    char text[FILE_STATEMENT_BYTES] = "";
    int n_stated = 0;
    for (int a = 2; a >= 0; a--) {
        size_m[a] = edge_m[a] > 0.0 && isfinite(edge_m[a]) ? edge_m[a] : NAN;
        if (isnan(size_m[a])) continue;
        stated_m = size_m[a];
        n_stated++;
    }
    if (n_stated == 0) return;
    for (int a = 0; a < 3; a++) {
        const size_t used = strlen(text);
        info->voxel_size_m[a] = size_m[a] > 0.0 ? size_m[a] : stated_m;
        if (n_stated == 3)
            snprintf(text + used, sizeof text - used, "%s%.6g", a > 0 ? " x " : "", 1e6 * size_m[a]);
        else if (size_m[a] > 0.0)
            snprintf(text + used, sizeof text - used, "%s%.6g um along %c", used > 0 ? ", " : "", 1e6 * size_m[a],
                     "xyz"[a]);
    }
    file_ledger_add(&info->ledger, "voxel size", NULL, "%s%s%s%s%s", text, n_stated == 3 ? " um" : " (else the same)",
                    source[0] != '\0' ? " (" : "", source, source[0] != '\0' ? ")" : "");
}
