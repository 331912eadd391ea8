#include "optimizer/photographs/reader/declared_color.h"

#include "base/files/durable.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct color_primaries adobe_rgb = {{{0.64, 0.33}, {0.21, 0.71}, {0.15, 0.06}, {0.3127, 0.3290}}};

void declared_color_release(struct declared_color *color)
{
    for (int c = 0; c < 3; c++)
        if (color->curve[c] != NULL) cmsFreeToneCurve(color->curve[c]);
    memset(color, 0, sizeof *color);
}

double declared_color_light(const struct declared_color *color, size_t c, double v)
{
    return (double)cmsEvalToneCurveFloat(color->curve[c], (float)v);
}

double declared_color_difference(const struct declared_color *color, enum job_transfer transfer)
{
    double most = 0.0;
    for (int i = 0; i <= 256; i++) {
        double v = i / 256.0, want = v;
        if (transfer == JOB_TRANSFER_SRGB) want = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
        for (size_t c = 0; c < 3; c++) most = fmax(most, fabs(declared_color_light(color, c, v) - want));
    }
    return most;
}

/* Takes over curves, one for all channels or one each. */
static status take_curves(struct declared_color *color, const char *source, const char *curve_name,
                          cmsToneCurve *const curve[3], struct error *err)
{
    bool complete = curve[0] != NULL && curve[1] != NULL && curve[2] != NULL;
    for (int c = 0; c < 3; c++) color->curve[c] = curve[c];
    if (!complete) {
        declared_color_release(color);
        return error_set(err, STATUS_NO_MEMORY, "cannot read the colors of a photograph: out of memory");
    }
    snprintf(color->source, sizeof color->source, "%s", source);
    snprintf(color->curve_name, sizeof color->curve_name, "%s", curve_name);
    return STATUS_OK;
}

/* type, parameter: of cmsBuildParametricToneCurve. */
static status take_parametric(struct declared_color *color, const char *source, const char *curve_name, int type,
                              const double *parameter, struct error *err)
{
    cmsToneCurve *curve[3];
    if (color->curve[0] != NULL) return STATUS_OK;
    for (int c = 0; c < 3; c++) curve[c] = cmsBuildParametricToneCurve(NULL, type, parameter);
    return take_curves(color, source, curve_name, curve, err);
}

status declared_color_power(struct declared_color *color, const char *source, double exponent, struct error *err)
{
    char name[48] = "linear";
    if (fabs(exponent - 1.0) > 1e-3) snprintf(name, sizeof name, "gamma %.4g", exponent);
    return take_parametric(color, source, name, 1, &exponent, err);
}

status declared_color_srgb(struct declared_color *color, const char *source, struct error *err)
{
    static const double parameter[5] = {2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045};
    return take_parametric(color, source, "the curve of sRGB", 4, parameter, err);
}

static status declare_bt709(struct declared_color *color, const char *source, struct error *err)
{
    static const double parameter[5] = {1.0 / 0.45, 1.0 / 1.099, 0.099 / 1.099, 1.0 / 4.5, 0.081};
    return take_parametric(color, source, "the curve of BT.709", 4, parameter, err);
}

/* A curve of Little CMS has at most 65,530 values. Of 65,536 every fifth is taken, from the first to the last. */
static cmsToneCurve *curve_of_table(uint32_t n, const uint16_t *table)
{
    enum { MOST = 65530, STEP = 5 };
    if (n <= MOST) return cmsBuildTabulatedToneCurve16(NULL, n, table);
    const uint32_t n_taken = (n - 1) / STEP + 1;
    uint16_t *taken = malloc(n_taken * sizeof *taken);
    for (uint32_t i = 0; taken != NULL && i < n_taken; i++) taken[i] = table[STEP * i];
    cmsToneCurve *curve = taken != NULL ? cmsBuildTabulatedToneCurve16(NULL, n_taken, taken) : NULL;
    free(taken);
    return curve;
}

status declared_color_tables(struct declared_color *color, const char *source, uint32_t n,
                             const uint16_t *const table[3], struct error *err)
{
    cmsToneCurve *curve[3];
    if (color->curve[0] != NULL) return STATUS_OK;
    for (int c = 0; c < 3; c++) curve[c] = curve_of_table(n, table[c]);
    return take_curves(color, source, "a table", curve, err);
}

void declared_color_primaries(struct photograph_info *info, const char *name, const struct color_primaries *p)
{
    const double(*xy)[2] = p->xy;
    double matrix[9];
    const char *reason = info->to_rec709[0] != 0.0            ? "another statement comes first"
                         : !color_primaries_matrix(p, matrix) ? "they are no primaries"
                                                              : NULL;
    file_ledger_add(&info->ledger, name, reason, "red %.4g %.4g, green %.4g %.4g, blue %.4g %.4g, white %.4g %.4g",
                    xy[0][0], xy[0][1], xy[1][0], xy[1][1], xy[2][0], xy[2][1], xy[3][0], xy[3][1]);
    if (reason == NULL) memcpy(info->to_rec709, matrix, sizeof matrix);
}

/* ---- ICC profiles ---- */

/* Reads the columns and curves of a matrix profile, or the curve of a profile of grey. Returns whether it has them. */
static bool read_profile(cmsHPROFILE profile, bool grey, double matrix[9], cmsToneCurve *curve[3])
{
    static const cmsTagSignature colorant[3] = {cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag},
                                 response[3] = {cmsSigRedTRCTag, cmsSigGreenTRCTag, cmsSigBlueTRCTag};
    double column[9];
    if (!grey && !cmsIsMatrixShaper(profile)) return false;
    for (int c = 0; c < 3; c++) {
        const cmsCIEXYZ *v = grey ? NULL : cmsReadTag(profile, colorant[c]);
        const cmsToneCurve *t = cmsReadTag(profile, grey ? cmsSigGrayTRCTag : response[c]);
        if (t == NULL || (!grey && v == NULL)) return false;
        curve[c] = cmsDupToneCurve(t);
        for (int row = 0; row < 3 && v != NULL; row++) column[3 * row + c] = row == 0 ? v->X : row == 1 ? v->Y : v->Z;
    }
    return grey || color_columns_matrix(column, matrix);
}

static status use_profile(struct declared_color *color, const char *path, cmsHPROFILE profile, bool grey,
                          struct photograph_info *info, struct error *err)
{
    char name[36] = "", source[48], shape[48];
    double matrix[9] = {0};
    cmsToneCurve *curve[3] = {0};
    cmsGetProfileInfoASCII(profile, cmsInfoDescription, "en", "US", name, sizeof name);
    snprintf(source, sizeof source, "ICC profile '%s'", name);
    if (!read_profile(profile, grey, matrix, curve)) {
        for (int c = 0; c < 3; c++)
            if (curve[c] != NULL) cmsFreeToneCurve(curve[c]);
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot use photograph '%s': its %s has no matrix and curves (it has tables): save the "
                         "original as sRGB, or linear",
                         path_file_name(path), source);
    }
    double gamma = cmsEstimateGamma(curve[0], 0.01);
    if (!(gamma > 0.0))
        snprintf(shape, sizeof shape, "a curve of its own");
    else if (fabs(gamma - 1.0) > 1e-3)
        snprintf(shape, sizeof shape, "gamma %.4g", gamma);
    else
        snprintf(shape, sizeof shape, "linear");
    memcpy(info->to_rec709, matrix, sizeof matrix);
    file_ledger_add(&info->ledger, "color profile", NULL, "'%s', %s", name, shape);
    return take_curves(color, source, shape, curve, err);
}

status declared_color_icc(struct declared_color *color, const char *path, const void *profile, size_t n_bytes,
                          bool grey, struct photograph_info *info, struct error *err)
{
    static const char name[] = "color profile";
    if (color->curve[0] != NULL) {
        file_ledger_add(&info->ledger, name, "another statement comes first", "%zu bytes", n_bytes);
        return STATUS_OK;
    }
    cmsHPROFILE p = n_bytes <= UINT32_MAX ? cmsOpenProfileFromMem(profile, (cmsUInt32Number)n_bytes) : NULL;
    if (p == NULL) {
        file_ledger_add(&info->ledger, name, "it is damaged", "%zu bytes", n_bytes);
        return STATUS_OK;
    }
    const cmsColorSpaceSignature space = cmsGetColorSpace(p);
    status s = STATUS_OK;
    if (space != (grey ? cmsSigGrayData : cmsSigRgbData))
        file_ledger_add(&info->ledger, name, grey ? "the picture is grey" : "the picture is rgb", "of %c%c%c%c",
                        (int)(space >> 24 & 127), (int)(space >> 16 & 127), (int)(space >> 8 & 127),
                        (int)(space & 127));
    else
        s = use_profile(color, path, p, grey, info, err);
    cmsCloseProfile(p);
    return s;
}

/* ---- code points of ITU-T H.273 ---- */

static const struct {
    uint8_t code;
    struct color_primaries p;
} h273[] = {
    {1, {{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}}}},
    {4, {{{0.67, 0.33}, {0.21, 0.71}, {0.14, 0.08}, {0.310, 0.316}}}},
    {5, {{{0.64, 0.33}, {0.29, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}}}},
    {6, {{{0.630, 0.340}, {0.310, 0.595}, {0.155, 0.070}, {0.3127, 0.3290}}}},
    {7, {{{0.630, 0.340}, {0.310, 0.595}, {0.155, 0.070}, {0.3127, 0.3290}}}},
    {9, {{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}}}},
    {10, {{{1.0, 0.0}, {0.0, 1.0}, {0.0, 0.0}, {1.0 / 3.0, 1.0 / 3.0}}}},
    {11, {{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.314, 0.351}}}},
    {12, {{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.3127, 0.3290}}}},
    {22, {{{0.630, 0.340}, {0.295, 0.605}, {0.155, 0.077}, {0.3127, 0.3290}}}},
};

static status declare_h273_curve(struct declared_color *color, uint8_t code, bool *known, struct error *err)
{
    static const char source[] = "cICP chunk";
    *known = true;
    switch (code) {
    case 1:
    case 6:
    case 14:
    case 15:
        return declare_bt709(color, source, err);
    case 4:
        return declared_color_power(color, source, 2.2, err);
    case 5:
        return declared_color_power(color, source, 2.8, err);
    case 8:
        return declared_color_power(color, source, 1.0, err);
    case 13:
        return declared_color_srgb(color, source, err);
    default:
        *known = false;
        return STATUS_OK;
    }
}

status declared_color_cicp(struct declared_color *color, const char *path, const uint8_t code[4],
                           struct photograph_info *info, struct error *err)
{
    const char *name = path_file_name(path);
    bool known = false;
    if (code[1] == 16 || code[1] == 18)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot use photograph '%s': its cICP chunk says that it is %s, a curve for displays of high "
                         "range: save the original as linear or sRGB",
                         name, code[1] == 16 ? "PQ" : "HLG");
    status s = declare_h273_curve(color, code[1], &known, err);
    if (s != STATUS_OK) return s;
    const struct color_primaries *p = NULL;
    for (size_t i = 0; i < sizeof h273 / sizeof *h273; i++)
        if (h273[i].code == code[0]) p = &h273[i].p;
    if (!known || p == NULL || code[2] != 0 || code[3] != 1)
        return error_set(
            err, STATUS_UNSUPPORTED,
            "cannot use photograph '%s': its cICP chunk (%u %u %u %u) names colors that are not known here: "
            "save the original as linear or sRGB",
            name, code[0], code[1], code[2], code[3]);
    file_ledger_add(&info->ledger, "cICP", NULL, "%u %u %u %u, %s", code[0], code[1], code[2], code[3],
                    color->curve_name);
    declared_color_primaries(info, "cICP primaries", p);
    return STATUS_OK;
}

status declared_color_exif(struct declared_color *color, struct photograph_info *info, struct error *err)
{
    static const char name[] = "Exif color space", source[] = "Exif color space";
    const unsigned space = info->exif_color_space;
    status s = STATUS_OK;
    if (space == 0) return STATUS_OK;
    const char *reason = color->curve[0] != NULL    ? "another statement comes first"
                         : space != 1 && space != 2 ? "it names no curve"
                                                    : NULL;
    file_ledger_add(&info->ledger, name, reason, "%s", space == 1 ? "sRGB" : space == 2 ? "Adobe RGB" : "uncalibrated");
    if (reason != NULL) return STATUS_OK;
    s = space == 1 ? declared_color_srgb(color, source, err) : declared_color_power(color, source, 563.0 / 256.0, err);
    if (s == STATUS_OK && space == 2) declared_color_primaries(info, "Exif primaries", &adobe_rgb);
    return s;
}
