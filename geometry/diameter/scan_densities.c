#include "geometry/diameter/scan_densities.h"

#include "geometry/diameter/fiber_diameter.h"
#include "geometry/volume/density_map.h"
#include "geometry/volume/noise_smoothing.h"

#include <math.h>

static status smooth(struct volume *v, double diameter_voxel, struct thread_pool *pool, struct scan_noise *noise,
                     struct error *err)
{
    struct fiber_diameter d = {.voxel = diameter_voxel};
    status s = STATUS_OK;
    if (isnan(diameter_voxel)) s = fiber_diameter_measure(v, pool, NULL, &d, err);
    /* thin fibers that do not stand out of the noise need less of it more than all of the scan's resolution */
    if (s == STATUS_OK) noise->smooth_voxel = noise_smoothing_sd(noise->scan_sd, d.hidden ? d.other_voxel : d.voxel);
    if (s == STATUS_OK && d.hidden) {
        noise->hidden_diameter_voxel = d.voxel;
        noise->hidden_noise_share = d.noise_share;
    }
    if (s == STATUS_OK && noise->smooth_voxel > 0.0) s = volume_smooth_noise(v, noise->smooth_voxel, pool, err);
    if (s == STATUS_OK) noise->mapped_sd = density_noise_sd(v, 0.0, 1.0);
    return s;
}

status scan_densities_map(struct volume *v, double low, double high, double diameter_voxel, struct thread_pool *pool,
                          struct scan_noise *noise, struct error *err)
{
    *noise = (struct scan_noise){.hidden_diameter_voxel = NAN, .hidden_noise_share = NAN};
    if (high > low && isfinite(high - low)) noise->scan_sd = noise->mapped_sd = density_noise_sd(v, low, high);
    if (!(noise_smoothing_sd(noise->scan_sd, INFINITY) > 0.0)) return density_map_apply(v, low, high, pool, err);
    status s = density_map_wide(v, low, high, pool, err);
    if (s == STATUS_OK) s = smooth(v, diameter_voxel, pool, noise, err);
    return s == STATUS_OK ? density_map_apply(v, 0.0, 1.0, pool, err) : s;
}
