#include "optimizer/report/lobes/table_lamps.h"

#include <math.h>

static const double same_rad = 1e-6;

static bool same_angle(double a, double b) { return fabs(remainder(a - b, 2.0 * M_PI)) < same_rad; }

static bool same_lamp(const struct configuration *a, const struct configuration *b)
{
    return fabs(a->light_theta_rad - b->light_theta_rad) < same_rad &&
           (a->light_theta_rad < same_rad || same_angle(a->light_phi_rad, b->light_phi_rad));
}

size_t table_lamp_row(const struct observation_set *o, size_t i)
{
    size_t k = 0;
    while (!same_lamp(&o->item[k].configuration, &o->item[i].configuration)) k++;
    return k;
}

size_t table_lamp_count(const struct observation_set *o)
{
    size_t n = 0;
    for (size_t k = 0; k < o->n; k++) n += table_lamp_row(o, k) == k;
    return n;
}

struct table_camera table_camera_of(const struct configuration *c)
{
    double apart = fmod(c->camera_phi_rad - c->light_phi_rad, 2.0 * M_PI);
    if (apart < -same_rad) apart += 2.0 * M_PI;
    const bool away = apart > M_PI_2 - same_rad && apart < 1.5 * M_PI - same_rad;
    double plane = fmod(apart, M_PI);
    if (plane > M_PI - same_rad) plane -= M_PI;
    return (struct table_camera){fmax(plane, 0.0), away ? c->camera_theta_rad : -c->camera_theta_rad};
}

bool table_same_lobe(const struct observation_set *o, size_t i, size_t j)
{
    const struct configuration *a = &o->item[i].configuration, *b = &o->item[j].configuration;
    if (!same_lamp(a, b) || a->n_rotation != b->n_rotation) return false;
    if (a->n_rotation <= 1 && !same_angle(a->cloth_rotation_rad, b->cloth_rotation_rad)) return false;
    return fabs(table_camera_of(a).plane_rad - table_camera_of(b).plane_rad) < same_rad;
}

size_t table_lobe_row(const struct observation_set *o, size_t i)
{
    size_t k = 0;
    while (!table_same_lobe(o, k, i)) k++;
    return k;
}

size_t table_lobe_count(const struct observation_set *o)
{
    size_t n = 0;
    for (size_t k = 0; k < o->n; k++) n += table_lobe_row(o, k) == k;
    return n;
}
