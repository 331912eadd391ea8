#include "optimizer/photographs/rows/observation_check.h"
#include "base/option_id.h"

#include <math.h>
#include <stdlib.h>

enum { NAMED = 3 };

/* A row is dark when its brightness per incident light is below this share of the median of the rows lit from the
 * same side. From the front, measured cloths have no row below 0.33 of the median and black satins none below 0.07.
 * Light that passes through a dense cloth beside its gaps can be far less. */
static const double dark_share_front = 0.04, dark_share_behind = 1e-3;
static const double least_cos = 0.05; /* a lamp has a size, so part of it stays above the horizon */
/* Radiance, in units of a white diffuser facing the lamp, above which a row is too bright. Highlights of measured
 * cloths reach 2. */
static const double brightest = 20.0;
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

static bool lit_from_behind(const struct observation *o) { return o->configuration.light_theta_rad > M_PI_2; }

/* Brightness per light that falls on the cloth, so that a row is not dark only because its lamp is at a grazing
 * angle. */
static double reflected(const struct observation *o)
{
    return brightness(o) / fmax(fabs(cos(o->configuration.light_theta_rad)), least_cos);
}

/* Median of `reflected` over the rows of a weight above 0 that are lit from one side. */
static double median_reflected(const struct observation_set *o, bool behind)
{
    double *v = malloc((o->n + 1) * sizeof *v), median = 0.0;
    size_t n = 0;
    if (v == NULL) return 0.0;
    for (size_t i = 0; i < o->n; i++)
        if (o->item[i].weight > 0.0 && lit_from_behind(&o->item[i]) == behind) v[n++] = reflected(&o->item[i]);
    qsort(v, n, sizeof *v, compare_double);
    if (n > 0) median = v[n / 2];
    free(v);
    return median;
}

static void check_dark(const struct observation_set *o, const struct warning_sink *warn)
{
    const double median[2] = {median_reflected(o, false), median_reflected(o, true)};
    size_t n_dark = 0;
    for (size_t i = 0; i < o->n; i++) {
        const struct observation *item = &o->item[i];
        bool behind = lit_from_behind(item);
        double a = reflected(item), share = behind ? dark_share_behind : dark_share_front;
        if ((a > 0.0 && a >= share * median[behind]) || !(item->weight > 0.0)) continue;
        if (++n_dark > NAMED) continue;
        if (a > 0.0)
            warning_send(warn, OPTION_NONE,
                         "row '%s' is dark: its brightness %.2g is %.2g %% of what the others lead to expect "
                         "under its lamp",
                         item->name, brightness(item), 100.0 * a / median[behind]);
        else
            warning_send(warn, OPTION_NONE, "row '%s' is zero in all channels: was the lamp on?", item->name);
    }
    if (n_dark > NAMED) warning_send(warn, OPTION_NONE, "%zu more rows are dark or zero", n_dark - NAMED);
}

/* Largest radiance that a cloth can have; through gaps the lamp behind it is visible. Infinite under an image of the
 * surroundings, whose radiance has no known bound. */
static double brightest_possible(const struct configuration *c)
{
    const double *around = c->environment_rgb;
    if (c->environment != NULL) return INFINITY;
    double lamp = M_PI * c->light_distance_m * c->light_distance_m / (c->lamp_side_m * c->lamp_side_m);
    double most = brightest * (1.0 + fmax(around[0], fmax(around[1], around[2])));
    return c->light_theta_rad > M_PI_2 && c->light == LIGHT_SQUARE_LAMP ? fmax(most, lamp) : most;
}

static void check_bright(const struct observation_set *o, const struct warning_sink *warn)
{
    size_t n_bright = 0;
    for (size_t i = 0; i < o->n; i++) {
        const struct observation *item = &o->item[i];
        double largest = fmax(fmax(item->mean_rgb[0], item->mean_rgb[1]), item->mean_rgb[2]);
        if (!(item->weight > 0.0) || largest <= brightest_possible(&item->configuration)) continue;
        if (++n_bright > NAMED) continue;
        warning_send(
            warn, OPTION_NONE,
            "row '%s' is brighter than any cloth: its radiance is %.3g, that of a perfect white diffuser facing "
            "the lamp is 1; is its scale right?",
            item->name, largest);
    }
    if (n_bright > NAMED)
        warning_send(warn, OPTION_NONE, "%zu more rows are brighter than any cloth", n_bright - NAMED);
}

/* Unit vector towards theta, phi. */
static void direction_of(double theta_rad, double phi_rad, double d[3])
{
    d[0] = sin(theta_rad) * cos(phi_rad);
    d[1] = sin(theta_rad) * sin(phi_rad);
    d[2] = cos(theta_rad);
}

static bool close_to(const double *a, const double *b)
{
    return fmax(fmax(fabs(a[0] - b[0]), fabs(a[1] - b[1])), fabs(a[2] - b[2])) < 1e-6;
}

/* Compares the directions of lamp and camera as seen from the cloth, because different angles can describe one
 * direction (180 and -180, any phi at theta 0). Of means over rotations only the phi between lamp and camera is
 * compared. */
static bool same_configuration(const struct configuration *a, const struct configuration *b)
{
    const struct configuration *of[2] = {a, b};
    double light[2][3], camera[2][3], between[2][3];
    if (a->n_rotation != b->n_rotation) return false;
    for (int i = 0; i < 2; i++) {
        double turn = of[i]->cloth_rotation_rad;
        direction_of(of[i]->light_theta_rad, of[i]->light_phi_rad - turn, light[i]);
        direction_of(of[i]->camera_theta_rad, of[i]->camera_phi_rad - turn, camera[i]);
        between[i][0] = light[i][0] * camera[i][0] + light[i][1] * camera[i][1];
        between[i][1] = light[i][0] * camera[i][1] - light[i][1] * camera[i][0];
        between[i][2] = light[i][2];
    }
    if (a->n_rotation > 1) return close_to(between[0], between[1]) && fabs(camera[0][2] - camera[1][2]) < 1e-6;
    return close_to(light[0], light[1]) && close_to(camera[0], camera[1]);
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

static void check_contradictions(const struct observation_set *o, const struct warning_sink *warn)
{
    size_t n = 0;
    for (size_t i = 0; i < o->n; i++) {
        for (size_t j = 0; j < i; j++) {
            const struct observation *a = &o->item[j], *b = &o->item[i];
            if (!(a->weight > 0.0 && b->weight > 0.0) || !same_configuration(&a->configuration, &b->configuration))
                continue;
            double difference = contradiction(a, b);
            if (!(difference > 0.0) || ++n > NAMED) continue;
            warning_send(
                warn, OPTION_NONE,
                "rows '%s' and '%s' have the same angles to the cloth and differ by %.0f %%: no model fits both",
                a->name, b->name, 100.0 * difference);
        }
    }
    if (n > NAMED) warning_send(warn, OPTION_NONE, "%zu more pairs of rows contradict each other", n - NAMED);
}

void observation_set_check(const struct observation_set *o, const struct warning_sink *warn)
{
    check_dark(o, warn);
    check_bright(o, warn);
    check_contradictions(o, warn);
}
