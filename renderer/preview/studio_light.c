#include "renderer/preview/studio_light.h"
#include "base/angle.h"
#include "renderer/transport/environment.h"

#include <math.h>

enum { N_ROW = 48, N_COLUMN = 96 };
static const double key_theta_deg = 48.0, key_phi_deg = 185.0, key_sharpness = 12.0;
static const double zenith = 0.32, horizon = 0.18; /* radiance of the fill */
/* Soft lights beside the key, each a lobe as of a Gaussian lamp: behind the cloth, and beside the camera. */
static const struct studio_lobe {
    double theta_deg, phi_deg, radiance, sharpness;
} lobe[] = {{62.0, 40.0, 1.4, 11.0}, {62.0, 280.0, 0.35, 4.0}};
static const double below_bent = 0.35, below_flat = 0.12, dim_room = 0.06; /* radiances */

static double radiance_of(enum studio_kind kind, const double d[3])
{
    if (kind == STUDIO_LIGHT_TABLE) return d[2] < 0.0 ? 1.0 : dim_room;
    if (d[2] < 0.0) return kind == STUDIO_ABOVE_GROUND ? below_bent : below_flat;
    double sum = horizon + (zenith - horizon) * d[2];
    for (size_t k = 0; k < sizeof lobe / sizeof *lobe; k++) {
        const double theta = lobe[k].theta_deg * RAD_PER_DEG, phi = lobe[k].phi_deg * RAD_PER_DEG;
        const double cosine = d[0] * sin(theta) * cos(phi) + d[1] * sin(theta) * sin(phi) + d[2] * cos(theta);
        sum += lobe[k].radiance * exp(lobe[k].sharpness * (cosine - 1.0));
    }
    return sum;
}

status studio_light_set(enum studio_kind kind, struct configuration *c, struct environment **environment,
                        struct error *err)
{
    struct image im;
    status s = image_init(&im, N_COLUMN, N_ROW, 3, err);
    if (s != STATUS_OK) return s;
    for (size_t y = 0; y < N_ROW; y++)
        for (size_t x = 0; x < N_COLUMN; x++) {
            const double theta = M_PI * ((double)y + 0.5) / N_ROW, phi = 2.0 * M_PI * ((double)x + 0.5) / N_COLUMN;
            const double d[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            for (int k = 0; k < 3; k++) im.pixel[(y * N_COLUMN + x) * 3 + (size_t)k] = (float)radiance_of(kind, d);
        }
    s = environment_new(&im, 1.0, environment, err);
    image_release(&im);
    if (s != STATUS_OK) return s;
    c->environment = *environment;
    c->light = kind == STUDIO_LIGHT_TABLE ? LIGHT_NO_LAMP : LIGHT_GAUSSIAN;
    c->light_sharpness = key_sharpness;
    c->light_theta_rad = key_theta_deg * RAD_PER_DEG;
    c->light_phi_rad = key_phi_deg * RAD_PER_DEG;
    c->unseen_lights = kind != STUDIO_LIGHT_TABLE;
    return STATUS_OK;
}

double studio_exposure(const struct image *cloth)
{
    const double medium = 0.3, base = 0.9, least = 0.7, most = 3.0;
    double sum = 0.0, n = 0.0;
    for (size_t i = 0; i < cloth->width * cloth->height; i++) {
        const float *p = cloth->pixel + i * cloth->n_channel;
        const double brightness = 0.2126 * (double)p[0] + 0.7152 * (double)p[1] + 0.0722 * (double)p[2];
        sum += brightness;
        n += brightness > 0.0;
    }
    return base * (sum > 0.0 ? fmin(fmax(sqrt(medium * n / sum), least), most) : 1.0);
}
