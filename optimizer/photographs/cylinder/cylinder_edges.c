#include "optimizer/photographs/cylinder/cylinder_edges.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_BAND = 24, LEAST_BAND = 5, LEAST_MARGIN = 4, LEAST_SIZE = 24 };
static const double enough_bands = 0.6, /* share of the bands that must show an edge */
    least_step = 0.04,                 /* departure from the background, as share of bright cloth after a square root */
    least_steepness = 0.15,            /* of the departure four pixels further on: the steepest pixel of an edge */
    steep_px = 4.0, deep_share = 0.08, /* an edge rises within steep_px, a shadow over deep_share of the width */
    least_rise = 0.45,                 /* of its light at that depth */
    least_se_px = 0.2, largest_rms = 0.01 /* of the width */;

void cylinder_edges_to_frame(enum job_axis axis, const double xy[2], double uv[2])
{
    const double x = xy[0], y = xy[1];
    uv[0] = axis == JOB_AXIS_UP ? x : axis == JOB_AXIS_DOWN ? -x : axis == JOB_AXIS_RIGHT ? y : -y;
    uv[1] = axis == JOB_AXIS_UP ? y : axis == JOB_AXIS_DOWN ? -y : axis == JOB_AXIS_RIGHT ? -x : x;
}

void cylinder_edges_to_picture(enum job_axis axis, const double uv[2], double xy[2])
{
    const double u = uv[0], v = uv[1];
    xy[0] = axis == JOB_AXIS_UP ? u : axis == JOB_AXIS_DOWN ? -u : axis == JOB_AXIS_RIGHT ? -v : v;
    xy[1] = axis == JOB_AXIS_UP ? v : axis == JOB_AXIS_DOWN ? -v : axis == JOB_AXIS_RIGHT ? u : -u;
}

status cylinder_edges_of_points(enum job_axis axis, const double px[8], struct cylinder_edges *e, struct error *err)
{
    *e = (struct cylinder_edges){.se_px = 0.5};
    double middle[2] = {0};
    for (size_t k = 0; k < 2; k++) {
        double a[2], b[2];
        cylinder_edges_to_frame(axis, px + 4 * k, a);
        cylinder_edges_to_frame(axis, px + 4 * k + 2, b);
        if (!(fabs(b[1] - a[1]) >= 1.0) || !(fabs(b[0] - a[0]) <= fabs(b[1] - a[1])))
            return error_set(
                err, STATUS_INVALID,
                "the two points of a silhouette do not lie along the axis of the cylinder: the order is two "
                "points of one, then two of the other");
        e->line[k][1] = (b[0] - a[0]) / (b[1] - a[1]);
        e->line[k][0] = a[0] - e->line[k][1] * a[1];
        middle[k] = 0.5 * (a[1] + b[1]);
    }
    const double v = 0.5 * (middle[0] + middle[1]);
    if (e->line[0][0] + e->line[0][1] * v > e->line[1][0] + e->line[1][1] * v) {
        const struct cylinder_edges other = *e;
        memcpy(e->line[0], other.line[1], sizeof e->line[0]);
        memcpy(e->line[1], other.line[0], sizeof e->line[1]);
    }
    if (cylinder_edges_width_px(e, v) >= 2.0 && fabs(e->line[0][1] - e->line[1][1]) < 0.2) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "the two silhouettes cross, or are less than two pixels apart");
}

double cylinder_edges_width_px(const struct cylinder_edges *e, double v)
{
    const double slope = 0.5 * (e->line[0][1] + e->line[1][1]);
    return (e->line[1][0] - e->line[0][0] + (e->line[1][1] - e->line[0][1]) * v) / hypot(1.0, slope);
}

void cylinder_edges_part(const struct cylinder_edges *e, enum job_axis axis, const double v[2], const double s[2],
                         double corner_px[4][2])
{
    static const size_t at_v[4] = {0, 0, 1, 1}, at_s[4] = {0, 1, 1, 0};
    for (size_t i = 0; i < 4; i++) {
        const double y = v[at_v[i]], left = e->line[0][0] + e->line[0][1] * y,
                     right = e->line[1][0] + e->line[1][1] * y;
        const double uv[2] = {0.5 * (left + right) + 0.5 * s[at_s[i]] * (right - left), y};
        cylinder_edges_to_picture(axis, uv, corner_px[i]);
    }
}

/* ---- search ---- */

/* The picture as bands along the axis: `light` has the mean of each band at each place across, over the brightest
 * cloth; tone is its square root. */
struct bands {
    size_t n_u, n_v, n_band;
    float *light, *tone;
};

static int compare_float(const void *a, const void *b)
{
    float x, y;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    return x < y ? -1 : x > y;
}

/* Sum of the channels of the pixel at (u, v) of the turned picture. */
static float light_at(const struct image *im, enum job_axis axis, size_t u, size_t v)
{
    const size_t w = im->width - 1, h = im->height - 1;
    const size_t x = axis == JOB_AXIS_UP ? u : axis == JOB_AXIS_DOWN ? w - u : axis == JOB_AXIS_RIGHT ? w - v : v;
    const size_t y = axis == JOB_AXIS_UP ? v : axis == JOB_AXIS_DOWN ? h - v : axis == JOB_AXIS_RIGHT ? u : h - u;
    const float *p = im->pixel + im->n_channel * (y * im->width + x);
    return fmaxf(p[0] + p[1] + p[2], 0.0f);
}

static status bands_make(const struct image *im, enum job_axis axis, struct bands *b, struct error *err)
{
    const bool upright = axis == JOB_AXIS_UP || axis == JOB_AXIS_DOWN;
    b->n_u = upright ? im->width : im->height;
    b->n_v = upright ? im->height : im->width;
    b->n_band = b->n_v / 4 < MAX_BAND ? b->n_v / 4 : MAX_BAND;
    if (b->n_u < LEAST_SIZE || b->n_band < LEAST_BAND)
        return error_set(err, STATUS_NOT_FOUND, "the picture has only %zu x %zu pixels", im->width, im->height);
    const size_t n = b->n_band * b->n_u;
    b->light = calloc(n, sizeof *b->light);
    b->tone = calloc(n, sizeof *b->tone);
    if (b->light == NULL || b->tone == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot look for the cylinder: out of memory");
    for (size_t i = 0; i < n; i++) {
        const size_t band = i / b->n_u, v0 = band * b->n_v / b->n_band, v1 = (band + 1) * b->n_v / b->n_band;
        for (size_t v = v0; v < v1; v++) b->light[i] += light_at(im, axis, i % b->n_u, v) / (float)(v1 - v0);
    }
    memcpy(b->tone, b->light, n * sizeof *b->tone);
    qsort(b->tone, n, sizeof *b->tone, compare_float);
    const float bright = b->tone[n - 1 - n / 50];
    if (!(bright > 0.0f)) return error_set(err, STATUS_NOT_FOUND, "the picture is black");
    for (size_t i = 0; i < n; i++) {
        b->light[i] /= bright;
        b->tone[i] = sqrtf(fminf(b->light[i], 1.0f));
    }
    return STATUS_OK;
}

/* A band as it is seen from one of its sides: element i from that side. */
struct side_view {
    const float *value;
    size_t n;
    bool from_right;
};

static double side_value(const struct side_view *k, size_t i)
{
    return (double)k->value[k->from_right ? k->n - 1 - i : i];
}

/* Finds the place of the steepest step next to the first departure from the background, in pixels from the side's end
 * of the picture; NaN without one. *background: mean tone of it. */
static double first_step(const struct side_view *tone, double *background)
{
    const size_t margin = LEAST_MARGIN > tone->n / 50 ? LEAST_MARGIN : tone->n / 50;
    double sum = 0.0, square = 0.0;
    for (size_t i = 0; i < margin; i++) {
        sum += side_value(tone, i) / (double)margin;
        square += side_value(tone, i) * side_value(tone, i) / (double)margin;
    }
    *background = sum;
    const double limit = fmax(least_step, 6.0 * sqrt(fmax(0.0, square - sum * sum)));
    size_t first = margin;
    while (first + 4 < tone->n / 2 &&
           !(fabs(side_value(tone, first) - sum) > limit && fabs(side_value(tone, first + 1) - sum) > limit))
        first++;
    if (first + 4 >= tone->n / 2) return NAN;
    double best = 0.0, at = NAN;
    for (size_t i = first - 2; i <= first + 3; i++) {
        const double here = fabs(side_value(tone, i + 1) - side_value(tone, i));
        if (here <= best) continue;
        const double before = fabs(side_value(tone, i) - side_value(tone, i - 1)),
                     after = fabs(side_value(tone, i + 2) - side_value(tone, i + 1)),
                     bend = before - 2.0 * here + after;
        best = here;
        at = (double)i + 1.0 + (bend < 0.0 ? fmin(fmax(0.5 * (before - after) / bend, -0.5), 0.5) : 0.0);
    }
    return best > least_steepness * fabs(side_value(tone, first + 4) - sum) ? at : NAN;
}

/* Returns whether the light rises as at an edge, not slowly as where a shadow ends. */
static bool is_sharp(const struct side_view *light, double at, double width)
{
    const double deep = deep_share * width;
    const size_t i = (size_t)at, steep = i + (size_t)steep_px, far = i + (size_t)deep;
    if (deep < 2.0 * steep_px || far + 1 >= light->n || i < 4) return true;
    const double background = side_value(light, i - 3);
    return fabs(side_value(light, steep) - background) > least_rise * fabs(side_value(light, far) - background);
}

static int compare_double(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median(double *value, size_t n)
{
    qsort(value, n, sizeof *value, compare_double);
    return n % 2 == 1 ? value[n / 2] : 0.5 * (value[n / 2 - 1] + value[n / 2]);
}

/* Least squares over the bands whose place lies within `reach` of the line; all with an infinite one. */
static size_t fit_once(const struct bands *b, const double *place, double reach, double line[2], double *rms)
{
    double n = 0.0, sv = 0.0, su = 0.0, svv = 0.0, suv = 0.0, square = 0.0;
    const double before[2] = {line[0], line[1]};
    for (int pass = 0; pass < 2; pass++)
        for (size_t i = 0; i < b->n_band; i++) {
            const double v = ((double)i + 0.5) * (double)b->n_v / (double)b->n_band;
            if (isnan(place[i]) || fabs(place[i] - before[0] - before[1] * v) > reach) continue;
            if (pass == 1) {
                square += pow(place[i] - line[0] - line[1] * v, 2.0);
                continue;
            }
            n += 1.0, sv += v, su += place[i], svv += v * v, suv += v * place[i];
            if (n < 2.0) continue;
            line[1] = (n * suv - sv * su) / fmax(n * svv - sv * sv, 1e-9);
            line[0] = (su - line[1] * sv) / n;
        }
    *rms = n > 0.0 ? sqrt(square / n) : 0.0;
    return (size_t)n;
}

/* A robust line: the median of the slopes between bands, then least squares over what lies near it. */
static size_t fit_line(const struct bands *b, const double *place, double line[2], double *rms)
{
    double slope[MAX_BAND * MAX_BAND], level[MAX_BAND];
    size_t n_slope = 0, n = 0;
    const double step = (double)b->n_v / (double)b->n_band;
    for (size_t i = 0; i < b->n_band; i++)
        for (size_t j = i + 1; j < b->n_band; j++)
            if (!isnan(place[i]) && !isnan(place[j]))
                slope[n_slope++] = (place[j] - place[i]) / ((double)(j - i) * step);
    if (n_slope == 0) return 0;
    line[1] = median(slope, n_slope);
    for (size_t i = 0; i < b->n_band; i++)
        if (!isnan(place[i])) level[n++] = place[i] - line[1] * ((double)i + 0.5) * step;
    line[0] = median(level, n);
    return fit_once(b, place, 2.5, line, rms);
}

static status fit_edges(const struct bands *b, double place[2][MAX_BAND], struct cylinder_edges *e, struct error *err)
{
    static const char *const name[2] = {"-x", "+x"};
    double rms[2], width = 0.0;
    size_t n[2];
    for (size_t k = 0; k < 2; k++) {
        n[k] = fit_line(b, place[k], e->line[k], &rms[k]);
        if ((double)n[k] < enough_bands * (double)b->n_band)
            return error_set(err, STATUS_NOT_FOUND,
                             "its silhouette on the side of %s shows in %zu of %zu parts of the picture", name[k], n[k],
                             b->n_band);
    }
    width = cylinder_edges_width_px(e, 0.5 * (double)b->n_v);
    if (fabs(e->line[0][1] - e->line[1][1]) > 0.1 || fabs(e->line[0][1]) > 0.5)
        return error_set(err, STATUS_NOT_FOUND, "what look like its silhouettes are not parallel to the axis");
    if (!(width > 8.0) || fmax(rms[0], rms[1]) > fmax(1.0, largest_rms * width))
        return error_set(err, STATUS_NOT_FOUND, "what look like its silhouettes are not straight");
    e->se_px = fmax(least_se_px, fmax(rms[0] / sqrt((double)n[0]), rms[1] / sqrt((double)n[1])));
    return STATUS_OK;
}

/* Places of both edges in all bands. */
static void find_places(const struct bands *b, double place[2][MAX_BAND], struct cylinder_edges *e)
{
    double dark = 0.0;
    for (size_t i = 0; i < b->n_band; i++) {
        double background[2];
        const double n = (double)b->n_u;
        for (size_t k = 0; k < 2; k++) {
            const struct side_view tone = {b->tone + i * b->n_u, b->n_u, k == 1};
            const double at = first_step(&tone, &background[k]);
            place[k][i] = k == 1 ? n - at : at;
            dark = fmax(dark, background[k]);
        }
        const double width = place[1][i] - place[0][i];
        for (size_t k = 0; k < 2 && !isnan(width); k++) {
            const struct side_view light = {b->light + i * b->n_u, b->n_u, k == 1};
            if (!is_sharp(&light, k == 1 ? n - place[k][i] : place[k][i], width)) place[k][i] = NAN;
        }
    }
    e->dark_background = dark < 0.15;
}

status cylinder_edges_find(const struct image *im, const double origin_px[2], enum job_axis axis,
                           struct cylinder_edges *e, struct error *err)
{
    struct bands b = {0};
    double place[2][MAX_BAND] = {0};
    *e = (struct cylinder_edges){0};
    status s = bands_make(im, axis, &b, err);
    if (s == STATUS_OK) {
        find_places(&b, place, e);
        s = fit_edges(&b, place, e, err);
    }
    free(b.light);
    free(b.tone);
    if (s != STATUS_OK) return s;
    /* the corner of the turned picture where u and v were counted from */
    const double w = (double)im->width, h = (double)im->height;
    const double corner[2] = {origin_px[0] + (axis == JOB_AXIS_DOWN || axis == JOB_AXIS_RIGHT ? w : 0.0),
                              origin_px[1] + (axis == JOB_AXIS_DOWN || axis == JOB_AXIS_LEFT ? h : 0.0)};
    double uv[2];
    cylinder_edges_to_frame(axis, corner, uv);
    for (size_t k = 0; k < 2; k++) e->line[k][0] += uv[0] - e->line[k][1] * uv[1];
    return STATUS_OK;
}
