#include "optimizer/report/textures/texture_maps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double mm = 1e3;
/* Yarns are smooth on the scale of some fibers: standard deviation of the smoothing, in fiber radii. */
static const double smooth_radii = 3.0;
/* Largest fine pixel, in fiber radii. */
static const double fine_radii = 0.5;
enum { N_BOX = 3, MOST_FINE_EDGE = 1024 }; /* box filters one after the other come near to a Gaussian */

struct raster {
    struct texture_maps *m;
    float *axis; /* x 2: cos and sin of twice the direction of the fiber that is seen, 0 where there is none */
    double z_high_m;
};

static float *floats(size_t n) { return calloc(n > 0 ? n : 1, sizeof(float)); }

static size_t wrapped(long i, size_t n)
{
    long k = i % (long)n;
    return (size_t)(k < 0 ? k + (long)n : k);
}

/* A ball of a fiber at p: raises the pixels that it covers. */
static void add_ball(const struct raster *r, const double p[3], double radius_mm, const float axis[2])
{
    struct texture_maps *m = r->m;
    double x = p[0] / m->pixel_mm[0] + 0.5 * (double)m->width, y = 0.5 * (double)m->height - p[1] / m->pixel_mm[1];
    long rx = (long)ceil(radius_mm / m->pixel_mm[0]), ry = (long)ceil(radius_mm / m->pixel_mm[1]);
    for (long j = (long)floor(y) - ry; j <= (long)floor(y) + ry; j++)
        for (long i = (long)floor(x) - rx; i <= (long)floor(x) + rx; i++) {
            double dx = ((double)i + 0.5 - x) * m->pixel_mm[0], dy = (y - (double)j - 0.5) * m->pixel_mm[1];
            double up2 = radius_mm * radius_mm - dx * dx - dy * dy;
            size_t at = wrapped(j, m->height) * m->width + wrapped(i, m->width);
            if (up2 <= 0.0 || p[2] + sqrt(up2) <= (double)m->height_mm[at]) continue;
            m->height_mm[at] = (float)(p[2] + sqrt(up2));
            m->cover[at] = 1.0f;
            m->fiber_normal[3 * at] = (float)(dx / radius_mm);
            m->fiber_normal[3 * at + 1] = (float)(dy / radius_mm);
            m->fiber_normal[3 * at + 2] = (float)(sqrt(up2) / radius_mm);
            memcpy(r->axis + 2 * at, axis, 2 * sizeof *axis);
        }
}

static void add_segment(const struct raster *r, const double a[3], const double b[3], double radius_mm)
{
    double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, flat = hypot(d[0], d[1]), length = hypot(flat, d[2]);
    double step = 0.5 * fmin(r->m->pixel_mm[0], r->m->pixel_mm[1]), phi = atan2(d[1], d[0]);
    double share = length > 0.0 ? flat / length : 0.0;
    const float axis[2] = {(float)(share * cos(2.0 * phi)), (float)(share * sin(2.0 * phi))};
    size_t n = (size_t)ceil(length / step) + 1;
    for (size_t k = 0; k < n; k++) {
        double t = ((double)k + 0.5) / (double)n;
        const double p[3] = {a[0] + t * d[0], a[1] + t * d[1], a[2] + t * d[2]};
        add_ball(r, p, radius_mm, axis);
    }
}

static void add_fibers(const struct raster *r, const struct fiber_set *f)
{
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t v = f->first_vertex[i]; v + 1 < f->first_vertex[i + 1]; v++) {
            double p[2][3];
            for (int k = 0; k < 2; k++)
                for (size_t a = 0; a < 3; a++)
                    p[k][a] = mm * ((double)f->position_m[3 * (v + (size_t)k) + a] - (a == 2 ? r->z_high_m : 0.0));
            add_segment(r, p[0], p[1], 0.5 * mm * (double)(fiber_radius_m(f, i, v) + fiber_radius_m(f, i, v + 1)));
        }
}

/* A mean over 2 half + 1 neighbours along a line of n values, which repeats. */
static void box_line(const float *from, float *to, size_t n, size_t stride, long half)
{
    double sum = 0.0;
    for (long k = -half; k <= half; k++) sum += (double)from[wrapped(k, n) * stride];
    for (size_t i = 0; i < n; i++) {
        to[i * stride] = (float)(sum / (double)(2 * half + 1));
        sum +=
            (double)from[wrapped((long)i + half + 1, n) * stride] - (double)from[wrapped((long)i - half, n) * stride];
    }
}

void texture_maps_smooth(const struct texture_maps *m, float *value, size_t n_channel, double sd_mm, float *room)
{
    /* A box of width w has the variance (w^2 - 1) / 12. */
    long half[2];
    for (int a = 0; a < 2; a++) {
        double sd = sd_mm / m->pixel_mm[a];
        half[a] = lround(0.5 * (sqrt(12.0 * sd * sd / N_BOX + 1.0) - 1.0));
    }
    for (size_t c = 0; c < n_channel; c++)
        for (int k = 0; k < N_BOX; k++) {
            for (size_t j = 0; j < m->height; j++) {
                size_t at = n_channel * j * m->width + c;
                box_line(value + at, room + at, m->width, n_channel, half[0]);
            }
            for (size_t i = 0; i < m->width; i++) {
                size_t at = n_channel * i + c;
                box_line(room + at, value + at, m->height, n_channel * m->width, half[1]);
            }
        }
}

static void normal_of_slopes(double sx, double sy, float n[3])
{
    double inv = 1.0 / sqrt(1.0 + sx * sx + sy * sy);
    n[0] = (float)(-sx * inv);
    n[1] = (float)(-sy * inv);
    n[2] = (float)inv;
}

static void make_normals(struct texture_maps *m, const float *height_mm)
{
    for (size_t j = 0; j < m->height; j++)
        for (size_t i = 0; i < m->width; i++) {
            const float *line = height_mm + j * m->width;
            double sx = (double)(line[wrapped((long)i + 1, m->width)] - line[wrapped((long)i - 1, m->width)]);
            double sy = (double)(height_mm[wrapped((long)j - 1, m->height) * m->width + i] -
                                 height_mm[wrapped((long)j + 1, m->height) * m->width + i]);
            normal_of_slopes(0.5 * sx / m->pixel_mm[0], 0.5 * sy / m->pixel_mm[1], m->normal + 3 * (j * m->width + i));
        }
}

/* Mean square of the slope between the normals of fiber and surface, where a fiber is not seen edge on. */
static void make_spread(struct texture_maps *m)
{
    for (size_t i = 0; i < m->width * m->height; i++) {
        const float *a = m->fiber_normal + 3 * i, *b = m->normal + 3 * i;
        double cosine = (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2];
        cosine = fmin(fmax(cosine, 0.2), 1.0);
        m->spread[i] = (float)(1.0 / (cosine * cosine) - 1.0);
    }
}

static void divide_by_mean(float *value, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += (double)value[i];
    for (size_t i = 0; i < n; i++) value[i] = sum > 0.0 ? (float)((double)value[i] * (double)n / sum) : 1.0f;
}

static void make_directions(struct texture_maps *m, const float *axis)
{
    for (size_t i = 0; i < m->width * m->height; i++) {
        double x = (double)axis[2 * i], y = (double)axis[2 * i + 1], phi = 0.5 * atan2(y, x);
        m->spread[i] = sqrtf(fmaxf(m->spread[i], 0.0f));
        m->coherence[i] = (float)fmin(hypot(x, y), 1.0);
        m->direction_rad[i] = (float)(phi < 0.0 ? phi + M_PI : phi);
    }
}

double texture_maps_radius_mm(const struct fiber_set *f)
{
    double sum = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) sum += mm * (double)f->radius_m[i];
    return sum / (double)f->n_fiber;
}

static bool allocate(struct texture_maps *m)
{
    size_t n = m->width * m->height;
    m->height_mm = floats(n);
    m->fiber_normal = floats(3 * n);
    m->normal = floats(3 * n);
    m->spread = floats(n);
    m->direction_rad = floats(n);
    m->coherence = floats(n);
    m->cover = floats(n);
    return m->cover && m->height_mm && m->fiber_normal && m->normal && m->spread && m->direction_rad && m->coherence;
}

static void fill(struct texture_maps *m, const struct raster *r, const struct fiber_set *f, float *smooth_mm,
                 float *room)
{
    const size_t n = m->width * m->height;
    const double sd_mm = smooth_radii * texture_maps_radius_mm(f);
    double low, high;
    fiber_set_z_range_m(f, &low, &high);
    for (size_t i = 0; i < n; i++) {
        m->height_mm[i] = (float)(mm * (low - high));
        m->fiber_normal[3 * i + 2] = 1.0f;
    }
    add_fibers(r, f);
    memcpy(smooth_mm, m->height_mm, n * sizeof *smooth_mm);
    texture_maps_smooth(m, smooth_mm, 1, sd_mm, room);
    make_normals(m, smooth_mm);
    make_spread(m);
    texture_maps_smooth(m, m->spread, 1, sd_mm, room);
    texture_maps_smooth(m, r->axis, 2, sd_mm, room);
}

/* ---- pixels of the texture ---- */

/* Adds what a fine pixel has to its pixel: mean slopes in place of the normal, whose length is 1 again later. */
static void add_pixel(struct texture_maps *m, size_t to, const struct texture_maps *fine, size_t from, float share)
{
    const float *n = fine->normal + 3 * from;
    m->height_mm[to] += share * fine->height_mm[from];
    m->spread[to] += share * fine->spread[from];
    m->cover[to] += share * fine->cover[from];
    for (size_t a = 0; a < 2; a++) m->normal[3 * to + a] += share * n[a] / fmaxf(n[2], 0.05f);
    for (size_t a = 0; a < 3; a++) m->fiber_normal[3 * to + a] += share * fine->fiber_normal[3 * from + a];
}

/* Means over squares of `step` fine pixels. What the slopes of the surface vary by inside a square adds to the spread.
 */
static void reduce(const struct texture_maps *fine, const float *fine_axis, size_t step, struct texture_maps *m,
                   float *axis)
{
    const float share = 1.0f / (float)(step * step);
    for (size_t j = 0; j < fine->height; j++)
        for (size_t i = 0; i < fine->width; i++) {
            const size_t from = j * fine->width + i, to = j / step * m->width + i / step;
            const float *n = fine->normal + 3 * from;
            add_pixel(m, to, fine, from, share);
            m->spread[to] += share * (n[0] * n[0] + n[1] * n[1]) / fmaxf(n[2] * n[2], 0.0025f);
            for (size_t a = 0; a < 2; a++) axis[2 * to + a] += share * fine_axis[2 * from + a];
        }
    for (size_t i = 0; i < m->width * m->height; i++) {
        float *n = m->normal + 3 * i, *f = m->fiber_normal + 3 * i;
        const float length = sqrtf(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
        m->spread[i] = fmaxf(m->spread[i] - n[0] * n[0] - n[1] * n[1], 0.0f);
        normal_of_slopes(-(double)n[0], -(double)n[1], n);
        for (size_t a = 0; a < 3; a++) f[a] = length > 0.0f ? f[a] / length : a == 2 ? 1.0f : 0.0f;
    }
}

/* Fine pixels along an edge of a pixel: so many that a fiber is seen, and no more than a cloth has room for. */
static size_t steps_of(const struct fiber_set *f, const struct texture_maps *m)
{
    const double wanted = ceil(fmax(m->pixel_mm[0], m->pixel_mm[1]) / (fine_radii * texture_maps_radius_mm(f)));
    const double most = floor((double)MOST_FINE_EDGE / (double)(m->width > m->height ? m->width : m->height));
    return (size_t)fmax(fmin(wanted, most), 1.0);
}

static bool make_fine(const struct fiber_set *f, const struct texture_maps *m, size_t step, struct texture_maps *fine,
                      float **axis)
{
    double low, high;
    fiber_set_z_range_m(f, &low, &high);
    *fine = (struct texture_maps){.width = step * m->width, .height = step * m->height};
    for (int a = 0; a < 2; a++) fine->pixel_mm[a] = m->pixel_mm[a] / (double)step;
    const size_t n = fine->width * fine->height;
    *axis = floats(2 * n);
    const struct raster r = {fine, *axis, high};
    float *smooth_mm = floats(n), *room = floats(2 * n);
    const bool whole = allocate(fine) && *axis != NULL && smooth_mm != NULL && room != NULL;
    if (whole) fill(fine, &r, f, smooth_mm, room);
    free(smooth_mm);
    free(room);
    return whole;
}

status texture_maps_make(const struct fiber_set *f, const size_t size[2], struct texture_maps *m, struct error *err)
{
    struct texture_maps fine = {0};
    float *fine_axis = NULL;
    *m = (struct texture_maps){.width = size[0], .height = size[1], .repeat = {1, 1}};
    for (int a = 0; a < 2; a++) m->pixel_mm[a] = mm * f->tile_size_m[a] / (double)size[a];
    const size_t step = steps_of(f, m), n = m->width * m->height;
    float *axis = floats(2 * n);
    const bool whole = axis != NULL && allocate(m) && make_fine(f, m, step, &fine, &fine_axis);
    if (whole) {
        reduce(&fine, fine_axis, step, m, axis);
        make_directions(m, axis);
        divide_by_mean(m->spread, n);
    }
    free(axis);
    free(fine_axis);
    texture_maps_release(&fine);
    return whole ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot make textures: out of memory");
}

double texture_maps_cover(const struct texture_maps *m)
{
    const size_t n = m->width * m->height;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += (double)m->cover[i];
    return sum / (double)n;
}

double texture_maps_opacity(const struct texture_maps *m, size_t i)
{
    return m->cut_out ? fmax((double)m->cover[i], 0.1) : 1.0;
}

void texture_maps_scale_normals(struct texture_maps *m, double factor)
{
    for (size_t i = 0; i < m->width * m->height; i++) {
        float *n = m->normal + 3 * i;
        if (n[2] > 0.0f) normal_of_slopes(-factor * (double)(n[0] / n[2]), -factor * (double)(n[1] / n[2]), n);
    }
}

void texture_maps_release(struct texture_maps *m)
{
    free(m->height_mm);
    free(m->fiber_normal);
    free(m->normal);
    free(m->spread);
    free(m->direction_rad);
    free(m->coherence);
    free(m->cover);
    free(m->share);
    *m = (struct texture_maps){0};
}
