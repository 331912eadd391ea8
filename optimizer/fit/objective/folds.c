#include "optimizer/fit/objective/folds.h"

#include <math.h>
#include <stdbool.h>

static const double same_angle_rad = 1e-6;

static bool same_angle(double a, double b) { return fabs(a - b) < same_angle_rad; }

static bool same_directions(const struct configuration *a, const struct configuration *b)
{
    return same_angle(a->light_theta_rad, b->light_theta_rad) && same_angle(a->light_phi_rad, b->light_phi_rad) &&
           same_angle(a->camera_theta_rad, b->camera_theta_rad) && same_angle(a->camera_phi_rad, b->camera_phi_rad);
}

size_t folds_deal(const struct observation_set *o, size_t *fold)
{
    size_t n_group = 0;
    for (size_t i = 0; i < o->n; i++) {
        size_t j = 0;
        fold[i] = FOLDS_MAX;
        if (o->item[i].expected) continue;
        while (j < i && !same_directions(&o->item[j].configuration, &o->item[i].configuration)) j++;
        fold[i] = j < i ? fold[j] : n_group++ % FOLDS_MAX;
    }
    return n_group < FOLDS_MAX ? n_group : FOLDS_MAX;
}
