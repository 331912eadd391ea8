#include "optimizer/tools/simulated_camera/studio.h"

#include "geometry/vision/vision_markers.h"
#include "optimizer/photographs/camera/color_chart.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double paper = 0.75, ink = 0.03, chart_board = 0.02, chart_table = 0.35;
/* Sizes of the chart, in units: a patch has 2.5 and a gap 0.25. */
static const double patch = 2.5, pitch = 2.75, chart_width = 16.25, chart_height = 10.75, chart_margin = 0.75;

status studio_init(struct studio *s, struct error *err)
{
    static const double corner_mm = 26.0, side_mm = 14.0;
    static const int id[4] = {3, 7, 11, 20};
    *s = (struct studio){
        .board = {.n = 4, .side_mm = side_mm}, .cloth_half_mm = 17.0, .chart_mm_per_unit = 3.2, .chart_turn_rad = 0.12};
    snprintf(s->board.dictionary, sizeof s->board.dictionary, "4x4_50");
    status st = STATUS_OK;
    for (size_t m = 0; m < s->board.n && st == STATUS_OK; m++) {
        s->board.id[m] = id[m];
        s->board.center_mm[m][0] = m % 2 == 0 ? -corner_mm : corner_mm;
        s->board.center_mm[m][1] = m < 2 ? corner_mm : -corner_mm;
        st = vision_draw_marker(s->board.dictionary, id[m], STUDIO_MARKER_PX, s->marker[m], err);
    }
    return st;
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3])
{
    for (size_t k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void normalise(double v[3])
{
    double length = sqrt(dot(v, v));
    for (size_t k = 0; k < 3; k++) v[k] /= length;
}

void studio_camera_init(struct studio_camera *c, double theta, double phi, double distance_mm, const double aim_mm[2])
{
    const double back[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
    const double up[3] = {-cos(theta) * cos(phi), -cos(theta) * sin(phi), sin(theta)};
    cross(up, back, c->crop_right);
    memcpy(c->crop_up, up, sizeof c->crop_up);
    for (size_t k = 0; k < 3; k++) {
        c->eye_mm[k] = distance_mm * back[k];
        c->forward[k] = aim_mm[0] * c->crop_right[k] - aim_mm[1] * up[k] - c->eye_mm[k];
    }
    normalise(c->forward);
    cross(c->forward, up, c->right);
    normalise(c->right);
    cross(c->forward, c->right, c->down);
}

/* ---- surfaces ---- */

/* Mirrors a coordinate of [0, 1] beyond its ends. */
static double mirrored(double u)
{
    u = fmod(fabs(u), 2.0);
    return u > 1.0 ? 2.0 - u : u;
}

static void cloth_radiance(const struct image *im, double u, double v, double rgb[3])
{
    size_t x = (size_t)(mirrored(u) * (double)im->width), y = (size_t)(mirrored(v) * (double)im->height);
    x = x < im->width ? x : im->width - 1;
    y = y < im->height ? y : im->height - 1;
    for (size_t c = 0; c < 3; c++) rgb[c] = (double)im->pixel[(y * im->width + x) * im->n_channel + c];
}

static double sheet_reflectance(const struct studio *s, double x_mm, double y_mm)
{
    for (size_t m = 0; m < s->board.n; m++) {
        double u = (x_mm - s->board.center_mm[m][0]) / s->board.side_mm + 0.5,
               v = 0.5 - (y_mm - s->board.center_mm[m][1]) / s->board.side_mm;
        if (!(u >= 0.0 && v >= 0.0 && u < 1.0 && v < 1.0)) continue;
        size_t at = (size_t)(v * STUDIO_MARKER_PX) * STUDIO_MARKER_PX + (size_t)(u * STUDIO_MARKER_PX);
        return s->marker[m][at] > 127 ? paper : ink;
    }
    return paper;
}

static void chart_reflectance(const struct studio *s, double x_mm, double y_mm, double rgb[3])
{
    double co = cos(s->chart_turn_rad), si = sin(s->chart_turn_rad);
    double u = (co * x_mm + si * y_mm) / s->chart_mm_per_unit + 0.5 * chart_width,
           v = 0.5 * chart_height - (co * y_mm - si * x_mm) / s->chart_mm_per_unit;
    bool on_board =
        u >= -chart_margin && v >= -chart_margin && u <= chart_width + chart_margin && v <= chart_height + chart_margin;
    for (size_t c = 0; c < 3; c++) rgb[c] = on_board ? chart_board : chart_table;
    if (u < 0.0 || v < 0.0 || u >= chart_width || v >= chart_height) return;
    if (fmod(u, pitch) < patch && fmod(v, pitch) < patch)
        color_chart_reference(false, (size_t)(v / pitch) * COLOR_CHART_COLUMNS + (size_t)(u / pitch), rgb);
}

/* Light at a place of the chart over the light in its middle. */
static double chart_light(const struct studio *s, double x_mm, double y_mm)
{
    const double half = 0.5 * chart_width * s->chart_mm_per_unit;
    const double along = (cos(s->chart_fall_phi_rad) * x_mm + sin(s->chart_fall_phi_rad) * y_mm) / half;
    return fmax(0.0, 1.0 + s->chart_fall / (2.0 - s->chart_fall) * along);
}

void studio_radiance(const struct studio_scene *k, const struct studio_camera *c, const double d[3], double rgb[3])
{
    const double to_sheet = -c->eye_mm[2] / d[2], x = c->eye_mm[0] + to_sheet * d[0],
                 y = c->eye_mm[1] + to_sheet * d[1];
    const struct studio *s = k->studio;
    if (k->cloth != NULL) {
        /* where the ray meets the plane through the orbit center perpendicular to the view of the rendering */
        const double to_crop = -dot(c->eye_mm, c->eye_mm) / dot(c->eye_mm, d);
        double at[3];
        for (size_t i = 0; i < 3; i++) at[i] = c->eye_mm[i] + to_crop * d[i];
        double u = dot(at, c->crop_right) / k->cloth_crop_mm, v = dot(at, c->crop_up) / k->cloth_crop_mm;
        bool rendered = fabs(u) <= 0.5 && fabs(v) <= 0.5;
        if (rendered || (fabs(x) < s->cloth_half_mm && fabs(y) < s->cloth_half_mm)) {
            cloth_radiance(k->cloth, u + 0.5, 0.5 - v, rgb);
            return;
        }
        for (size_t i = 0; i < 3; i++) rgb[i] = sheet_reflectance(s, x, y);
    } else {
        chart_reflectance(s, x, y, rgb);
        for (size_t i = 0; i < 3; i++) rgb[i] *= chart_light(s, x, y);
    }
    for (size_t i = 0; i < 3; i++) rgb[i] *= k->cos_light;
}
