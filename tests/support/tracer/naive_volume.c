#include "tests/support/tracer/naive_volume.h"

#include "tests/support/tracer/naive_tracer.h"
#include "tests/support/tracer/reference_two_lobe.h"

#include <math.h>
#include <string.h>

void naive_volume_init(struct naive_volume *n, const struct direction_volume *v, const double param[12], double d_per_m,
                       bool black_sheet, double sky)
{
    n->v = v;
    memcpy(n->param, param, sizeof n->param);
    n->d_per_m = d_per_m;
    n->black_sheet = black_sheet;
    n->sky = sky;
    for (int i = 0; i <= NAIVE_VOLUME_N_TABLE; i++)
        n->furnace[i] = reference_camera_furnace(param, i * M_PI_2 / NAIVE_VOLUME_N_TABLE, 0);
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* alpha S cos th_i divided by its integral for wo; directions in the fiber frame. */
static double phase(const struct naive_volume *n, const double wi[3], const double wo[3])
{
    double x = fabs(asin(fmin(1, fmax(-1, wo[0])))) / M_PI_2 * NAIVE_VOLUME_N_TABLE;
    int i = (int)fmin(x, NAIVE_VOLUME_N_TABLE - 1);
    double furnace = n->furnace[i] + (x - i) * (n->furnace[i + 1] - n->furnace[i]);
    return n->param[9] * reference_s(n->param, wi, wo, 0) * hypot(wi[1], wi[2]) / furnace;
}

/* Follows the ray through the voxels up to an optical depth. Returns true with the point of collision in p and the
 * fiber direction there in tangent, or false when the ray leaves the volume. */
static bool collide(const struct naive_volume *n, const double d[3], double depth, double p[3], double tangent[3])
{
    const struct direction_volume *v = n->v;
    for (;;) {
        size_t at[3];
        double t = INFINITY;
        for (int a = 0; a < 3; a++) {
            double size = v->voxel_size_m[a], cell = floor(p[a] / size), count = (double)v->n[a];
            if (fabs(p[a] / size - rint(p[a] / size)) < 1e-9) cell = rint(p[a] / size) - (d[a] < 0); /* on a face */
            if (a == 2 && (cell < 0 || cell >= count)) return false;
            double wrapped = cell - count * floor(cell / count);
            at[a] = (size_t)wrapped;
            if (d[a] != 0) t = fmin(t, ((cell + (d[a] > 0)) * size - p[a]) / d[a]);
        }
        size_t i = volume_index(v->n, at[0], at[1], at[2]);
        float u[3];
        direction_volume_get(v, i, u);
        for (int a = 0; a < 3; a++) tangent[a] = (double)u[a];
        double c = dot(tangent, d), sigma = n->d_per_m * v->density[i] / 255 * sqrt(fmax(0, 1 - c * c));
        bool ends = sigma * t > depth;
        double way = ends ? depth / sigma : t;
        for (int a = 0; a < 3; a++) p[a] += way * d[a];
        if (ends) return true;
        depth -= sigma * t;
    }
}

/* Draws a new direction d, uniform over the sphere, and returns its weight. */
static double scatter(const struct naive_volume *n, const double u[3], struct rng *r, double d[3])
{
    double v[3] = {-u[1], u[0], 0}, w[3], wo[3], wi[3], length = hypot(u[0], u[1]);
    if (length < 1e-6) {
        v[0] = length = 1;
        v[1] = 0;
    }
    for (int a = 0; a < 3; a++) v[a] /= length;
    for (int a = 0; a < 3; a++) w[a] = u[(a + 1) % 3] * v[(a + 2) % 3] - u[(a + 2) % 3] * v[(a + 1) % 3];
    wo[0] = -dot(d, u);
    wo[1] = -dot(d, v);
    wo[2] = -dot(d, w);
    wi[0] = 2 * rng_double(r) - 1;
    double cosine = sqrt(1 - wi[0] * wi[0]), azimuth = 2 * M_PI * rng_double(r);
    wi[1] = cosine * cos(azimuth);
    wi[2] = cosine * sin(azimuth);
    for (int a = 0; a < 3; a++) d[a] = wi[0] * u[a] + wi[1] * v[a] + wi[2] * w[a];
    return 4 * M_PI * phase(n, wi, wo);
}

double naive_volume_path(const struct naive_volume *n, const struct configuration *c, struct rng *r)
{
    double top = n->v->voxel_size_m[2] * (double)n->v->n[2], throughput = 1;
    double th = c->camera_theta_rad, phi = c->camera_phi_rad - c->cloth_rotation_rad;
    double back[3] = {sin(th) * cos(phi), sin(th) * sin(phi), cos(th)}, side[3] = {-sin(phi), cos(phi), 0};
    double up[3] = {back[1] * side[2] - back[2] * side[1], back[2] * side[0] - back[0] * side[2],
                    back[0] * side[1] - back[1] * side[0]};
    double x = (rng_double(r) - 0.5) * c->crop_m, y = (rng_double(r) - 0.5) * c->crop_m, d[3], p[3], length = 0;
    for (int a = 0; a < 3; a++) {
        d[a] = x * side[a] + y * up[a] - c->camera_distance_m * back[a];
        length += d[a] * d[a];
    }
    for (int a = 0; a < 3; a++) d[a] /= sqrt(length);
    for (int a = 0; a < 3; a++) p[a] = c->camera_distance_m * (back[a] - back[2] / d[2] * d[a]) + (a == 2 ? top : 0);
    for (int bounce = 0; throughput > 1e-7; bounce++) {
        double tangent[3], local[3];
        if (!collide(n, d, -log(1 - rng_double(r)), p, tangent)) {
            if (d[2] < 0 && n->black_sheet) return 0;
            for (int a = 0; a < 3; a++) local[a] = p[a] - (a == 2 ? top : 0);
            bool lamp = c->light == LIGHT_SQUARE_LAMP;
            return throughput * (n->sky + (lamp ? naive_lamp_radiance(c, local, d) : 0));
        }
        throughput *= scatter(n, tangent, r, d);
    }
    return 0;
}
