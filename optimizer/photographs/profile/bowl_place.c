#include "optimizer/photographs/profile/bowl_place.h"
#include "base/angle.h"
#include "optimizer/job/document/job_profile.h"

#include <math.h>

static const double least_cos_theta = 0.1; /* beyond 84 degrees the fiber's holders are in the way */

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Least distance in the yz plane of the line from o along d, up to `length`, from the fiber. */
static double distance_from_fiber(const double *fiber, const double *o, const double *d, double length)
{
    const double y = o[1] - fiber[1], z = o[2] - fiber[2], size = d[1] * d[1] + d[2] * d[2],
                 at = size > 0.0 ? fmin(fmax(-(y * d[1] + z * d[2]) / size, 0.0), length) : 0.0;
    return hypot(y + at * d[1], z + at * d[2]);
}

bool bowl_place_at(const struct job_bowl *bowl, const struct bowl_camera *camera, const double px[2],
                   struct bowl_place *place)
{
    const double *o = camera->position_mm, radius = bowl->radius_mm, rim_z = bowl->height_mm - radius;
    double d[3], p[3], v[3];
    bowl_camera_ray(camera, px, d);
    const double b = dot(o, d), root = b * b - dot(o, o) + radius * radius;
    if (!(root > 0.0)) return false;
    const double first = -b - sqrt(root), length = -b + sqrt(root); /* where the line enters and leaves the sphere */
    if (!(length > 0.0) || (first > 0.0 && o[2] + first * d[2] < rim_z)) return false;
    for (int c = 0; c < 3; c++) {
        p[c] = o[c] + length * d[c];
        v[c] = p[c] - bowl->fiber_mm[c];
    }
    if (p[2] > rim_z) return false;
    if (distance_from_fiber(bowl->fiber_mm, o, d, length) < bowl->fiber_mask_mm) return false;
    const double r2 = dot(v, v), r = sqrt(r2), sin_theta = v[0] / r, cos_theta = hypot(v[1], v[2]) / r,
                 cos_alpha = dot(v, p) / (r * radius), off_axis = dot(d, camera->axis[2]);
    place->theta_o_rad = atan2(sin_theta, cos_theta);
    place->azimuth_rad = atan2(-v[2], v[1]);
    place->factor = r2 / (radius * radius * cos_alpha * cos_theta);
    place->area = off_axis * off_axis * off_axis * length * length * radius / fabs(dot(d, p));
    place->counts = cos_theta > least_cos_theta &&
                    asin(fmin(-p[2] / radius, 1.0)) >= asin(-rim_z / radius) + bowl->rim_deg * RAD_PER_DEG;
    return true;
}
