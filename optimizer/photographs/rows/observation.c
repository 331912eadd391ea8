#include "optimizer/photographs/rows/observation.h"
#include "base/angle.h"
#include "optimizer/job/document/job_setup.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void observation_set_init(struct observation_set *o) { memset(o, 0, sizeof *o); }

void observation_set_release(struct observation_set *o)
{
    free(o->item);
    observation_set_init(o);
}

status observation_set_append(struct observation_set *o, const struct observation *item, struct error *err)
{
    if (o->n == o->capacity) {
        size_t capacity = o->capacity > 0 ? 2 * o->capacity : 64;
        struct observation *grown = realloc(o->item, capacity * sizeof *grown);
        if (grown == NULL)
            return error_set(err, STATUS_NO_MEMORY, "cannot hold %zu observations: out of memory", capacity);
        o->item = grown;
        o->capacity = capacity;
    }
    o->item[o->n++] = *item;
    return STATUS_OK;
}

size_t observation_set_count(const struct observation_set *o, enum job_set set)
{
    size_t n = 0;
    for (size_t i = 0; i < o->n; i++) n += o->item[i].set == set;
    return n;
}

status observation_set_select(const struct observation_set *o, enum job_set set, struct observation_set *part,
                              struct error *err)
{
    for (size_t i = 0; i < o->n; i++) {
        if (o->item[i].set != set) continue;
        status s = observation_set_append(part, &o->item[i], err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

void observation_set_weigh(struct observation_set *o)
{
    size_t n = 0;
    double mean = 0.0;
    for (size_t i = 0; i < o->n; i++) {
        if (!(o->item[i].weight > 0.0)) continue;
        mean += o->item[i].weight;
        o->item[n++] = o->item[i];
    }
    o->n = n;
    mean /= n > 0 ? (double)n : 1.0;
    for (size_t i = 0; i < n; i++) o->item[i].weight /= mean;
}

bool observation_is_contrast(const struct observation *o) { return o->configuration.contrast_cells > 0; }

bool observation_is_measured_mean(const struct observation *o) { return !o->expected && !observation_is_contrast(o); }

bool observation_contrast_known(const struct observation *o)
{
    return o->contrast_se_rgb[0] < 1.0 && o->contrast_se_rgb[1] < 1.0 && o->contrast_se_rgb[2] < 1.0;
}

struct observation observation_of_contrast(const struct observation *o, double weight)
{
    struct observation row = *o;
    row.configuration.contrast_cells = (uint32_t)o->n_cell;
    row.weight = observation_contrast_known(o) ? weight * o->weight : 0.0;
    memcpy(row.mean_rgb, o->contrast_rgb, sizeof row.mean_rgb);
    memcpy(row.se_rgb, o->contrast_se_rgb, sizeof row.se_rgb);
    return row;
}

status observation_set_append_contrasts(const struct observation_set *from, double weight, struct observation_set *to,
                                        struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i < from->n && s == STATUS_OK; i++) {
        struct observation row = observation_of_contrast(&from->item[i], weight);
        s = observation_set_append(to, &row, err);
    }
    return s;
}

struct configuration observation_configuration(const struct job_setup *setup, double light_theta_deg,
                                               double light_phi_deg, double camera_theta_deg, double camera_phi_deg,
                                               double cloth_rotation_deg)
{
    const double rad = RAD_PER_DEG, cm = 0.01;
    struct configuration c = {
        .light_theta_rad = light_theta_deg * rad,
        .light_phi_rad = light_phi_deg * rad,
        .camera_theta_rad = camera_theta_deg * rad,
        .camera_phi_rad = camera_phi_deg * rad,
        .cloth_rotation_rad = cloth_rotation_deg * rad,
        .light_distance_m = setup->lamp_distance_cm * cm,
        .lamp_side_m = setup->lamp_side_cm * cm,
        .camera_distance_m = setup->camera_distance_cm * cm,
        .crop_m = setup->crop_cm * cm,
        .blur_m = setup->camera_blur_mm * 1e-3,
        .light = setup->lamp_directional ? LIGHT_DIRECTIONAL : LIGHT_SQUARE_LAMP,
        .camera = setup->camera_far_field ? CAMERA_FAR_FIELD : CAMERA_PERSPECTIVE,
    };
    memcpy(c.environment_rgb, setup->environment_rgb, sizeof c.environment_rgb);
    return c;
}
