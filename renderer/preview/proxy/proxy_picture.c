#include "renderer/preview/proxy/proxy_picture.h"
#include "renderer/preview/proxy/proxy_layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static status make(const struct proxy_surface *s, struct thread_pool *pool, const struct progress *progress,
                   struct proxy_layers *l, float *rgb, struct error *err)
{
    struct progress_part part[4] = {
        {progress, 0.0, 0.05}, {progress, 0.05, 0.3}, {progress, 0.35, 0.35}, {progress, 0.7, 0.3}};
    struct progress inner[4];
    for (int i = 0; i < 4; i++) inner[i] = progress_of_part(&part[i]);
    status st = proxy_layers_init(s, pool, &inner[0], l, err);
    if (st == STATUS_OK) st = proxy_shadow_make(s, pool, &inner[1], l, err);
    if (st == STATUS_OK) st = proxy_bounce_make(s, pool, &inner[2], l, err);
    return st == STATUS_OK ? proxy_lens_make(s, l, pool, &inner[3], rgb, err) : st;
}

status proxy_picture_render(const struct proxy_request *q, struct thread_pool *pool, const struct progress *progress,
                            struct image *im, struct error *err)
{
    struct proxy_surface s;
    struct proxy_layers l = {0};
    memset(im, 0, sizeof *im);
    status st = proxy_surface_init(&s, q, err);
    const size_t n = q->width * q->height;
    float *rgb = st == STATUS_OK ? malloc(3 * n * sizeof *rgb) : NULL;
    if (st == STATUS_OK && rgb == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot make a preview of %zu x %zu pixels: out of memory", q->width,
                       q->height);
    if (st == STATUS_OK) st = image_init(im, q->width, q->height, 6, err);
    if (st == STATUS_OK) st = make(&s, pool, progress, &l, rgb, err);
    for (size_t i = 0; i < n && st == STATUS_OK; i++)
        for (size_t c = 0; c < 3; c++) {
            im->pixel[6 * i + c] = rgb[3 * i + c];
            im->pixel[6 * i + 3 + c] = NAN;
        }
    proxy_layers_release(&l);
    free(rgb);
    if (st != STATUS_OK) image_release(im);
    return st;
}
