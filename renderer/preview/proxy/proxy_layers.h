/* Filtered layers of the pinhole picture of a smooth surface, and the view through a lens, for proxy_picture.c. */
#ifndef SELVEDGE_RENDERER_PROXY_LAYERS_H
#define SELVEDGE_RENDERER_PROXY_LAYERS_H

#include "renderer/preview/proxy/proxy_surface.h"

struct proxy_layers {
    struct proxy_place *place;  /* [height][width]: at the middle of each pixel */
    struct ray_pixel *receiver; /* [height][width]: used where there is a place */
    float *visible;             /* [height][width][3]: share of the lamp's light that comes */
    float *bounce;              /* [height][width][3]: irradiance of other folds and the environment over pi */
};

/* Finds the places. STATUS_NO_MEMORY, STATUS_CANCELLED. Release in any case. */
status proxy_layers_init(const struct proxy_surface *s, struct thread_pool *pool, const struct progress *progress,
                         struct proxy_layers *l, struct error *err);
void proxy_layers_release(struct proxy_layers *l);

/* The receiver of a pixel with x along two axes, each a function of the place: `at` writes x of a point in mm. The
 * screen's way along each axis follows from the plane through the place. False: the plane is seen edge-on. */
typedef void proxy_axes(const struct proxy_surface *s, const struct proxy_place *p, const double point_mm[3],
                        double x[2]);
bool proxy_layers_receiver(const struct proxy_surface *s, const struct proxy_place *p, size_t i_pixel, proxy_axes *at,
                           struct ray_pixel *r);

/* The rays of one layer. `sample` writes rays, jitter and slopes of a pixel of the field; it runs on any thread. */
struct proxy_rays {
    struct ray_field *field;
    enum ray_filter_way way;
    void (*sample)(void *context, size_t i_pixel);
    void *context;
};
/* Samples all pixels, smooths their slopes, and writes mean[height][width][n_channel] as ray_filter does.
 * STATUS_NO_MEMORY, STATUS_CANCELLED. */
status proxy_rays_filter(const struct proxy_rays *rays, struct thread_pool *pool, const struct progress *progress,
                         float *mean, struct error *err);

/* Share of the lamp's light that comes to pixels, through other layers of the cloth, too. Without a lamp it is 1. */
status proxy_shadow_make(const struct proxy_surface *s, struct thread_pool *pool, const struct progress *progress,
                         struct proxy_layers *l, struct error *err);
/* Light of other folds, once reflected, and of the environment. */
status proxy_bounce_make(const struct proxy_surface *s, struct thread_pool *pool, const struct progress *progress,
                         struct proxy_layers *l, struct error *err);
/* The picture: rgb[height][width][3]. */
status proxy_lens_make(const struct proxy_surface *s, const struct proxy_layers *l, struct thread_pool *pool,
                       const struct progress *progress, float *rgb, struct error *err);

#endif
