#include "optimizer/photographs/observation_check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { NAMED = 3 };

/* Dark: below this share of the median brightness; no cloth has such a row among others that are lit. */
static const double dark_share = 1e-3;
static const double allowed_difference = 0.05, allowed_se = 5.0;

static double brightness(const struct observation *o)
{
    return (o->mean_rgb[0] + o->mean_rgb[1] + o->mean_rgb[2]) / 3.0;
}

static int compare_double(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median_brightness(const struct observation_set *o)
{
    double *v = malloc((o->n + 1) * sizeof *v), median = 0.0;
    if (v == NULL) return 0.0;
    for (size_t i = 0; i < o->n; i++) v[i] = brightness(&o->item[i]);
    qsort(v, o->n, sizeof *v, compare_double);
    if (o->n > 0) median = v[o->n / 2];
    free(v);
    return median;
}

static void check_dark(const struct observation_set *o, observation_warning warn, void *context)
{
    double median = median_brightness(o);
    size_t n_dark = 0;
    for (size_t i = 0; i < o->n; i++) {
        double a = brightness(&o->item[i]);
        char text[300];
        if ((a > 0.0 && a >= dark_share * median) || !(o->item[i].weight > 0.0)) continue;
        if (++n_dark > NAMED) continue;
        if (a > 0.0)
            snprintf(text, sizeof text, "row '%s' is dark: its brightness %.2g is far below that of the others (%.2g)",
                     o->item[i].name, a, median);
        else
            snprintf(text, sizeof text, "row '%s' is zero in all channels: was the lamp on?", o->item[i].name);
        warn(context, text);
    }
    if (n_dark > NAMED) {
        char text[100];
        snprintf(text, sizeof text, "%zu more rows are dark or zero", n_dark - NAMED);
        warn(context, text);
    }
}

static bool same_configuration(const struct configuration *a, const struct configuration *b)
{
    const double close = 1e-6;
    return fabs(a->light_theta_rad - b->light_theta_rad) < close && fabs(a->light_phi_rad - b->light_phi_rad) < close &&
           fabs(a->camera_theta_rad - b->camera_theta_rad) < close &&
           fabs(a->camera_phi_rad - b->camera_phi_rad) < close &&
           fabs(a->cloth_rotation_rad - b->cloth_rotation_rad) < close && a->n_rotation == b->n_rotation;
}

/* Largest difference of a channel relative to the brightness; 0 when noise explains it. */
static double contradiction(const struct observation *a, const struct observation *b)
{
    double scale = fmax(brightness(a), brightness(b)), largest = 0.0;
    for (int c = 0; c < 3; c++) {
        double difference = fabs(a->mean_rgb[c] - b->mean_rgb[c]);
        if (difference > allowed_se * hypot(a->se_rgb[c], b->se_rgb[c])) largest = fmax(largest, difference);
    }
    return scale > 0.0 && largest > allowed_difference * scale ? largest / scale : 0.0;
}

static void check_contradictions(const struct observation_set *o, observation_warning warn, void *context)
{
    size_t n = 0;
    for (size_t i = 0; i < o->n; i++) {
        for (size_t j = 0; j < i; j++) {
            const struct observation *a = &o->item[j], *b = &o->item[i];
            char text[500];
            if (!(a->weight > 0.0 && b->weight > 0.0) || !same_configuration(&a->configuration, &b->configuration)) continue;
            double difference = contradiction(a, b);
            if (!(difference > 0.0) || ++n > NAMED) continue;
            snprintf(text, sizeof text,
                     "rows '%s' and '%s' have the same angles and differ by %.0f %%: no model fits both", a->name,
                     b->name, 100.0 * difference);
            warn(context, text);
        }
    }
    if (n > NAMED) {
        char text[100];
        snprintf(text, sizeof text, "%zu more pairs of rows contradict each other", n - NAMED);
        warn(context, text);
    }
}

void observation_set_check(const struct observation_set *o, observation_warning warn, void *context)
{
    check_dark(o, warn, context);
    check_contradictions(o, warn, context);
}
