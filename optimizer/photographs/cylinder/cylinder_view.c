#include "optimizer/photographs/cylinder/cylinder_view.h"

#include <math.h>
#include <string.h>

enum { MEAN_POINTS = 64 };
static const double nearest = 1.2; /* radii from the axis */

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void direction_of(const struct cylinder_station *at, double out[3])
{
    out[0] = sin(at->theta_rad) * cos(at->phi_rad);
    out[1] = sin(at->theta_rad) * sin(at->phi_rad);
    out[2] = cos(at->theta_rad);
}

/* Place in the plane across the axis, from the axis; of a far station the direction. */
static void across(const struct cylinder_view *v, const struct cylinder_station *at, double xz[2])
{
    double d[3];
    direction_of(at, d);
    xz[0] = at->far ? d[0] : at->distance_mm * d[0];
    xz[1] = at->far ? d[2] : at->distance_mm * d[2] + v->radius_mm;
}

status cylinder_view_init(struct cylinder_view *v, struct error *err)
{
    double xz[2], length;
    across(v, &v->light, xz);
    length = hypot(xz[0], xz[1]);
    if (!v->light.far && length < nearest * v->radius_mm)
        return error_set(
            err, STATUS_INVALID,
            "its lamp is %.1f mm from the axis of the cylinder, whose radius is %g mm: one of them is wrong", length,
            v->radius_mm);
    across(v, &v->camera, xz);
    length = hypot(xz[0], xz[1]);
    if (!v->camera.far && length < nearest * v->radius_mm)
        return error_set(err, STATUS_INVALID,
                         "its camera is %.1f mm from the axis of the cylinder, whose radius is %g mm: one of them is "
                         "wrong",
                         length, v->radius_mm);
    if (v->camera.far && length < 0.1)
        return error_set(err, STATUS_INVALID, "its camera looks along the axis of the cylinder");
    v->camera_azimuth_rad = atan2(xz[0], xz[1]);
    v->axis_distance_mm = v->camera.far ? INFINITY : length;
    v->edge_rad = v->camera.far ? 0.5 * M_PI : acos(v->radius_mm / length);
    return STATUS_OK;
}

/* Tangent of the angle between the axis and a silhouette, seen from the camera. */
static double edge_tan(const struct cylinder_view *v)
{
    const double r = v->radius_mm, d = v->axis_distance_mm;
    return r / sqrt((d - r) * (d + r));
}

double cylinder_view_s(const struct cylinder_view *v, double a_rad)
{
    const double d = remainder(a_rad - v->camera_azimuth_rad, 2.0 * M_PI);
    if (fabs(d) >= v->edge_rad) return d > 0.0 ? 1.0 : -1.0;
    if (v->camera.far) return sin(d);
    return v->radius_mm * sin(d) / (v->axis_distance_mm - v->radius_mm * cos(d)) / edge_tan(v);
}

double cylinder_view_angle(const struct cylinder_view *v, double s)
{
    if (v->camera.far) return v->camera_azimuth_rad + asin(fmin(fmax(s, -1.0), 1.0));
    const double beta = atan(s * edge_tan(v)), sine = v->axis_distance_mm * sin(beta) / v->radius_mm;
    return v->camera_azimuth_rad + asin(fmin(fmax(sine, -1.0), 1.0)) - beta;
}

double cylinder_view_mean_angle(const struct cylinder_view *v, double s0, double s1)
{
    double sum = 0.0, weights = 0.0;
    for (size_t i = 0; i < MEAN_POINTS; i++) {
        const double at = ((double)i + 0.5) / MEAN_POINTS, weight = 1.0 - fabs(2.0 * at - 1.0);
        sum += weight * cylinder_view_angle(v, s0 + (s1 - s0) * at);
        weights += weight;
    }
    return sum / weights;
}

/* Height along the axis of the place at x, z that shows at the same height of the picture as the orbit center: both
 * lie in a plane through the direction of the view and across the axis' image. */
static double height_along(const struct cylinder_view *v, double x, double z)
{
    double back[3];
    direction_of(&v->camera, back);
    /* up is y without its part along the view */
    const double up[3] = {-back[1] * back[0], 1.0 - back[1] * back[1], -back[1] * back[2]};
    return up[1] > 1e-6 ? -(x * up[0] + z * up[2]) / up[1] : 0.0;
}

static void local_angles(const struct cylinder_station *at, const double p[3], double a_rad, double out[3])
{
    const double tangent[3] = {cos(a_rad), 0.0, -sin(a_rad)}, normal[3] = {sin(a_rad), 0.0, cos(a_rad)};
    double to[3];
    direction_of(at, to);
    for (size_t i = 0; i < 3 && !at->far; i++) to[i] = at->distance_mm * to[i] - p[i];
    const double x = dot(to, tangent), z = dot(to, normal);
    out[0] = atan2(hypot(x, to[1]), z);
    out[1] = atan2(to[1], x);
    out[2] = at->far ? INFINITY : sqrt(dot(to, to));
}

void cylinder_view_angles(const struct cylinder_view *v, double a_rad, struct cylinder_angles *out)
{
    double p[3] = {v->radius_mm * sin(a_rad), 0.0, v->radius_mm * (cos(a_rad) - 1.0)}, light[3], camera[3], d[3];
    p[1] = height_along(v, p[0], p[2]);
    local_angles(&v->light, p, a_rad, light);
    local_angles(&v->camera, p, a_rad, camera);
    *out = (struct cylinder_angles){light[0], light[1], light[2], camera[0], camera[1], camera[2], 1.0};
    if (v->light.far) return;
    direction_of(&v->light, d);
    out->lamp_cos = (v->light.distance_mm - dot(p, d)) / light[2];
}

double cylinder_view_width_px(const struct cylinder_view *v, double focal_px)
{
    double back[3];
    direction_of(&v->camera, back);
    return 2.0 * focal_px * edge_tan(v) * hypot(back[0], back[2]);
}

double cylinder_view_px_per_mm(const struct cylinder_view *v, double width_px)
{
    double back[3];
    direction_of(&v->camera, back);
    const double nearer = v->camera.far ? v->radius_mm : edge_tan(v) * (v->axis_distance_mm - v->radius_mm);
    return 0.5 * width_px / nearer * sqrt(fmax(0.0, 1.0 - back[1] * back[1]));
}
