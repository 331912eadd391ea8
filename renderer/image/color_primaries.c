#include "renderer/image/color_primaries.h"

#include <lcms2.h>
#include <lcms2_plugin.h>
#include <math.h>
#include <string.h>

static const struct color_primaries rec709 = {{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}}};

/* Columns: tristimulus values of the primaries, adapted to D50. */
static bool columns_of(const struct color_primaries *p, cmsMAT3 *columns)
{
    static const cmsTagSignature tag[3] = {cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag};
    const cmsCIExyY white = {p->xy[3][0], p->xy[3][1], 1.0};
    const cmsCIExyYTRIPLE color = {
        {p->xy[0][0], p->xy[0][1], 1.0}, {p->xy[1][0], p->xy[1][1], 1.0}, {p->xy[2][0], p->xy[2][1], 1.0}};
    cmsToneCurve *linear = cmsBuildGamma(NULL, 1.0);
    if (linear == NULL) return false;
    cmsHPROFILE profile = cmsCreateRGBProfile(&white, &color, (cmsToneCurve *[3]){linear, linear, linear});
    bool ok = profile != NULL;
    for (int c = 0; c < 3 && ok; c++) {
        const cmsCIEXYZ *v = cmsReadTag(profile, tag[c]);
        ok = v != NULL && isfinite(v->X) && isfinite(v->Y) && isfinite(v->Z);
        if (!ok) break;
        columns->v[0].n[c] = v->X;
        columns->v[1].n[c] = v->Y;
        columns->v[2].n[c] = v->Z;
    }
    if (profile != NULL) cmsCloseProfile(profile);
    cmsFreeToneCurve(linear);
    return ok;
}

static bool to_rec709(const cmsMAT3 *columns, double matrix[9])
{
    cmsMAT3 own, inverse, product;
    if (!columns_of(&rec709, &own) || !_cmsMAT3inverse(&own, &inverse)) return false;
    _cmsMAT3per(&product, &inverse, columns);
    for (int i = 0; i < 9; i++) {
        matrix[i] = product.v[i / 3].n[i % 3];
        if (!(fabs(matrix[i]) < 1e3)) return false;
    }
    return true;
}

static bool are_xyz(const struct color_primaries *p)
{
    static const double axis[3][2] = {{1.0, 0.0}, {0.0, 1.0}, {0.0, 0.0}};
    bool all = true;
    for (int c = 0; c < 3; c++)
        all = all && fabs(p->xy[c][0] - axis[c][0]) < 1e-4 && fabs(p->xy[c][1] - axis[c][1]) < 1e-4;
    return all;
}

bool color_primaries_matrix(const struct color_primaries *p, double matrix[9])
{
    cmsMAT3 columns;
    const double *w = p->xy[3];
    if (!(w[0] > 0.0 && w[1] > 0.0 && w[0] + w[1] < 1.0)) return false;
    if (!columns_of(p, &columns) || !to_rec709(&columns, matrix)) return false;
    const double white[3] = {w[0] / w[1], 1.0, (1.0 - w[0] - w[1]) / w[1]};
    for (int i = 0; i < 9 && are_xyz(p); i++) matrix[i] /= white[i % 3];
    return true;
}

bool color_columns_matrix(const double column_xyz_d50[9], double matrix[9])
{
    cmsMAT3 columns;
    for (int i = 0; i < 9; i++) columns.v[i / 3].n[i % 3] = column_xyz_d50[i];
    return to_rec709(&columns, matrix);
}

bool color_matrix_is_identity(const double matrix[9])
{
    double most = 0.0;
    for (int row = 0; row < 3; row++) {
        double change = 0.0;
        for (int c = 0; c < 3; c++) change += fabs(matrix[3 * row + c] - (row == c ? 1.0 : 0.0));
        most = fmax(most, change);
    }
    return most <= 0.0005;
}

void image_apply_matrix(struct image *im, const double matrix[9])
{
    for (size_t i = 0; i < im->width * im->height; i++) {
        float *p = im->pixel + i * im->n_channel;
        const double in[3] = {(double)p[0], (double)p[1], (double)p[2]};
        for (int c = 0; c < 3; c++)
            p[c] = (float)(matrix[3 * c] * in[0] + matrix[3 * c + 1] * in[1] + matrix[3 * c + 2] * in[2]);
    }
}
