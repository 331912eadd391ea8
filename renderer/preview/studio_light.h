/* The light of pictures for the eye: one set-up for every cloth, so that pictures of two cloths can be compared.
 *
 * Key: a spherical Gaussian lamp of half width 19 degrees, 48 degrees from the vertical, to the left of the camera.
 * Fill: an environment that is brighter above, with soft lights behind the cloth on the right and beside the camera;
 * from below comes what a light grey ground reflects. Light table: a plane of radiance 1 below, and a dim room above.
 * World frame of configuration.h. */
#ifndef SELVEDGE_RENDERER_STUDIO_LIGHT_H
#define SELVEDGE_RENDERER_STUDIO_LIGHT_H

#include "renderer/image/image.h"
#include "renderer/scene/configuration.h"

enum studio_kind {
    STUDIO_ABOVE_GROUND, /* a bent cloth: its lower side is lit by the ground around it */
    STUDIO_ON_GROUND,    /* a flat one that lies on the ground */
    STUDIO_LIGHT_TABLE   /* a flat one that is lit through */
};

#define STUDIO_GROUND_ALBEDO 0.5

/* Fills in lamp and environment of c; the camera is the caller's. The camera does not see the lights, but the light
 * table. environment: to be freed after c. STATUS_NO_MEMORY. */
status studio_light_set(enum studio_kind kind, struct configuration *c, struct environment **environment,
                        struct error *err);
/* The exposure of a picture of the cloth alone, without ground: so that a cloth of medium brightness keeps it, and
 * darker and lighter ones are brought halfway to it in stops, within bounds. Pixels without light do not count. */
double studio_exposure(const struct image *cloth);

#endif
