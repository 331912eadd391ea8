#include "renderer/transport/lights.h"

#include <math.h>
#include <string.h>

void lights_init(struct lights *l, const struct configuration *c)
{
    memset(l, 0, sizeof *l);
    l->has_lamp = c->light != LIGHT_NO_LAMP;
    if (l->has_lamp) lamp_init(&l->lamp, c);
    for (int k = 0; k < 3; k++) {
        l->constant[k] = (float)c->environment_rgb[k];
        if (l->constant[k] > 0) l->has_constant = true;
    }
    l->image = c->environment;
    l->unseen = c->unseen_lights;
    l->image_turn[0] = (float)cos(c->cloth_rotation_rad);
    l->image_turn[1] = (float)sin(c->cloth_rotation_rad);
}
