#include "tests/support/fiber/bowl_rays.h"
#include "base/rng.h"

#include <math.h>

struct vec {
    double x, y, z;
};

static struct vec of(const double *a) { return (struct vec){a[0], a[1], a[2]}; }
static struct vec add(struct vec a, double s, struct vec b)
{
    return (struct vec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static double dot(struct vec a, struct vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static struct vec cross(struct vec a, struct vec b)
{
    return (struct vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static struct vec unit(struct vec a) { return add((struct vec){0, 0, 0}, 1 / sqrt(dot(a, a)), a); }

struct lens_frame {
    struct vec eye, forward, right, down;
};

/* The picture's x axis is the x axis of the bowl as the camera sees it, turned about the line of sight. */
static struct lens_frame frame_of(const struct bowl_device *d)
{
    struct lens_frame f = {.eye = of(d->camera)};
    f.forward = unit(add(of(d->look_at), -1, f.eye));
    const struct vec x = {1, 0, 0}, across = unit(add(x, -dot(x, f.forward), f.forward)),
                     below = cross(f.forward, across);
    f.right = add(add((struct vec){0, 0, 0}, cos(d->turn_rad), across), sin(d->turn_rad), below);
    f.down = cross(f.forward, f.right);
    return f;
}

void bowl_rays_project(const struct bowl_device *d, const double at[3], double px[2])
{
    const struct lens_frame f = frame_of(d);
    const struct vec v = add(of(at), -1, f.eye);
    const double depth = dot(v, f.forward);
    px[0] = 0.5 * (double)d->width + d->focal_px * dot(v, f.right) / depth;
    px[1] = 0.5 * (double)d->picture_height + d->focal_px * dot(v, f.down) / depth;
}

/* The inside of the bowl that a ray meets from inside or through the opening. */
static bool meet(const struct bowl_device *d, struct vec o, struct vec w, double least, struct vec *p)
{
    const double b = dot(o, w), c = dot(o, o) - d->radius * d->radius, root = b * b - c;
    if (root <= 0) return false;
    const double at[2] = {-b - sqrt(root), -b + sqrt(root)};
    for (int k = 0; k < 2; k++) {
        if (at[k] <= least) continue;
        *p = add(o, at[k], w);
        if (p->z <= d->height - d->radius) return k == 1; /* the first meeting is with the outside of the wall */
    }
    return false;
}

/* Irradiance of a place by the fiber. */
static double direct(const struct bowl_device *d, struct vec p, struct rng *rng)
{
    const struct vec lamp = of(d->lamp);
    const double cos_i = sqrt(1 - lamp.x * lamp.x), along = d->lit_length / cos_i * (rng_double(rng) - 0.5);
    const struct vec from = add(of(d->fiber), along, (struct vec){1, 0, 0}), v = add(p, -1, from), w = unit(v),
                     normal = unit(add((struct vec){0, 0, 0}, -1, p));
    const float wi[3] = {(float)lamp.x, (float)lamp.y, (float)lamp.z}, wo[3] = {(float)w.x, (float)w.y, (float)w.z};
    float rgb[3];
    d->model->eval(d->state, wi, wo, rgb, NULL);
    const double radiance = (double)rgb[1] * cos_i, shown = d->strength / cos_i * sqrt(1 - w.x * w.x);
    return radiance * shown * -dot(normal, w) / dot(v, v);
}

/* A direction from a matte place, by its cosine. */
static struct vec bounce(struct vec normal, struct rng *rng)
{
    const double u = rng_double(rng), turn = 2 * M_PI * rng_double(rng);
    const struct vec a = fabs(normal.x) < 0.7 ? (struct vec){1, 0, 0} : (struct vec){0, 1, 0},
                     s = unit(cross(normal, a)), t = cross(normal, s);
    return add(add(add((struct vec){0, 0, 0}, sqrt(u) * cos(turn), s), sqrt(u) * sin(turn), t), sqrt(1 - u), normal);
}

/* Irradiance of a place by the fiber and by paths of light that end by chance. */
static double irradiance(const struct bowl_device *d, struct vec p, struct rng *rng)
{
    double sum = 0;
    do {
        sum += direct(d, p, rng);
        const struct vec normal = unit(add((struct vec){0, 0, 0}, -1, p));
        if (rng_double(rng) >= d->reflectance || !meet(d, p, bounce(normal, rng), 1e-6 * d->radius, &p)) return sum;
    } while (true);
}

/* Radiance of the bowl at a place: light from the fiber, and light from N_WAY other places. */
static double radiance_of(const struct bowl_device *d, struct vec p, struct rng *rng)
{
    enum { N_WAY = 12 };
    const struct vec normal = unit(add((struct vec){0, 0, 0}, -1, p));
    double sum = direct(d, p, rng);
    for (int k = 0; k < N_WAY; k++) {
        struct vec other;
        if (meet(d, p, bounce(normal, rng), 1e-6 * d->radius, &other))
            sum += d->reflectance / N_WAY * irradiance(d, other, rng);
    }
    return d->reflectance / M_PI * sum;
}

status bowl_rays_photograph(const struct bowl_device *d, bool with_fiber, unsigned seed, struct image *im)
{
    const struct lens_frame f = frame_of(d);
    const struct rng_key key = {.seed = seed};
    status s = image_init(im, d->width, d->picture_height, 3, NULL);
    for (size_t k = 0; s == STATUS_OK && k < d->width * d->picture_height; k++) {
        struct rng rng;
        double sum = 0, normal[2];
        rng_start(&rng, &key, (uint32_t)k, 0);
        for (unsigned i = 0; i < d->samples; i++) {
            const double x = (double)(k % d->width) + rng_double(&rng), y = (double)(k / d->width) + rng_double(&rng);
            const double u = (x - 0.5 * (double)d->width) / d->focal_px,
                         v = (y - 0.5 * (double)d->picture_height) / d->focal_px;
            struct vec p;
            if (!meet(d, f.eye, unit(add(add(f.forward, u, f.right), v, f.down)), 0, &p)) continue;
            sum += d->background * (0.5 + x / (double)d->width);
            if (with_fiber) sum += radiance_of(d, p, &rng);
        }
        rng_normal_pair(&rng, normal);
        for (int c = 0; c < 3; c++) im->pixel[3 * k + (size_t)c] = (float)(sum / d->samples + d->noise * normal[0]);
    }
    return s;
}
