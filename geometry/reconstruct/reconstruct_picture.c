/* Draws slices of the density volume with the reconstructed fibers that cross them. */
#include "geometry/reconstruct/reconstruct.h"

#include "geometry/fibers/slices/slice_frame.h"

#include <math.h>
#include <stdlib.h>

struct canvas {
    uint8_t *rgb;
    size_t width, height, zoom;
};

static void put_red(const struct canvas *c, long x, long y)
{
    if (x < 0 || y < 0 || x >= (long)c->width || y >= (long)c->height) return;
    uint8_t *p = c->rgb + 3 * ((size_t)y * c->width + (size_t)x);
    p[0] = 255;
    p[1] = p[2] = 0;
}

static void cross(const struct canvas *c, double u, double v)
{
    long x = lround(u * (double)c->zoom - 0.5), y = (long)c->height - 1 - lround(v * (double)c->zoom - 0.5),
         arm = (long)c->zoom;
    for (long i = -arm; i <= arm; i++) {
        put_red(c, x + i, y);
        put_red(c, x, y + i);
    }
}

static void fill_grey(const struct canvas *c, const struct volume *v, int axis, size_t i_slice)
{
    int au = slice_axis_u(axis), av = slice_axis_v(axis);
    for (size_t y = 0; y < c->height; y++) {
        scratch_keep_within(v->space);
        for (size_t x = 0; x < c->width; x++) {
            size_t i[3];
            i[axis] = i_slice;
            i[au] = x / c->zoom;
            i[av] = v->n[av] - 1 - y / c->zoom; /* upwards */
            float d = fminf(1.0f, fmaxf(0.0f, v->density[volume_index(v->n, i[0], i[1], i[2])]));
            uint8_t *p = c->rgb + 3 * (y * c->width + x);
            p[0] = p[1] = p[2] = (uint8_t)lrintf(255.0f * d);
        }
    }
}

status reconstruct_slice_picture(const struct volume *v, const struct fiber_set *f, int axis, size_t i_slice,
                                 uint8_t **rgb, size_t *width, size_t *height, struct error *err)
{
    *rgb = NULL;
    if (axis < 0 || axis > 2 || i_slice >= v->n[axis])
        return error_set(err, STATUS_INVALID, "cannot draw slice %zu perpendicular to axis %d", i_slice, axis);
    int au = slice_axis_u(axis), av = slice_axis_v(axis);
    size_t larger = v->n[au] > v->n[av] ? v->n[au] : v->n[av];
    struct canvas c = {.zoom = larger < 600 ? 3 : larger < 1200 ? 2 : 1};
    c.width = v->n[au] * c.zoom;
    c.height = v->n[av] * c.zoom;
    c.rgb = malloc(3 * c.width * c.height);
    if (c.rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot draw a slice: out of memory");
    fill_grey(&c, v, axis, i_slice);
    double plane_m = ((double)i_slice + 0.5) * v->voxel_size_m[axis];
    for (size_t l = 0; l < f->n_fiber; l++)
        for (size_t i = f->first_vertex[l]; i + 1 < f->first_vertex[l + 1]; i++) {
            const float *a = f->position_m + 3 * i, *b = a + 3;
            double da = (double)a[axis] - plane_m, db = (double)b[axis] - plane_m;
            if ((da < 0.0) == (db < 0.0)) continue;
            double t = da / (da - db);
            cross(&c, ((double)a[au] + t * (double)(b[au] - a[au])) / v->voxel_size_m[au],
                  ((double)a[av] + t * (double)(b[av] - a[av])) / v->voxel_size_m[av]);
        }
    *rgb = c.rgb;
    *width = c.width;
    *height = c.height;
    return STATUS_OK;
}
