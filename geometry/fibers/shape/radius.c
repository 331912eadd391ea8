#include "geometry/fibers/shape/radius.h"

#include "geometry/volume/volume_unknown.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = 16, FINE = BRICK * RADIUS_UPSAMPLING, N_FINE = FINE * FINE * FINE + SEGMENT_SLACK, MAX_BRICK = 500 };
enum { CUT_OFF = RADIUS_PARTS }; /* part of the segments near unknown voxels, which hide material around them */

struct radius_job {
    const struct volume *v;
    const struct segment_bricks *bricks;
    float eps_d;
    struct distance_histogram *histogram; /* RADIUS_PARTS per thread */
    float *distance2;                     /* N_FINE per thread */
    uint32_t *nearest;
    const uint32_t *chosen; /* numbers of the bricks that are measured */
    uint8_t *part;          /* part of each segment */
};

/* Position of a point between voxel centres along one axis, with edge values repeated: its value is (1 - f) *
 * value[i] + f * value[j]. */
struct between {
    size_t i, j;
    float f;
};

static struct between between_centres(float x, size_t n)
{
    float c = x - 0.5f, last = (float)(n - 1);
    c = c < 0.0f ? 0.0f : c > last ? last : c;
    size_t i = (size_t)c;
    return (struct between){i, i + 1 < n ? i + 1 : i, c - (float)i};
}

/* Densities at the points of a row along x, trilinear between voxel centres. */
static void row_densities(const struct volume *v, const struct between *x, size_t n_point, struct between y,
                          struct between z, float *density)
{
    const float *r00 = v->density + volume_index(v->n, 0, y.i, z.i),
                *r10 = v->density + volume_index(v->n, 0, y.j, z.i);
    const float *r01 = v->density + volume_index(v->n, 0, y.i, z.j),
                *r11 = v->density + volume_index(v->n, 0, y.j, z.j);
    float a[BRICK + 2], b[BRICK + 2]; /* the points of a row lie within a brick: its voxels, and one on either side */
    size_t from = x[0].i;
    for (size_t i = from; i <= x[n_point - 1].j; i++) {
        a[i - from] = (1.0f - y.f) * r00[i] + y.f * r10[i];
        b[i - from] = (1.0f - y.f) * r01[i] + y.f * r11[i];
    }
    for (size_t k = 0; k < n_point; k++) {
        size_t i = x[k].i - from, j = x[k].j - from;
        density[k] =
            (1.0f - z.f) * ((1.0f - x[k].f) * a[i] + x[k].f * a[j]) + z.f * ((1.0f - x[k].f) * b[i] + x[k].f * b[j]);
    }
}

static size_t part_of(size_t i_brick) { return (uint32_t)(i_brick * 2246822519u) >> 29; }

/* Finds the brick of the middle of a segment. Returns false, with the nearest brick, if the middle lies outside of
 * the volume. */
static bool brick_of(const struct segment_bricks *b, const struct segment *g, size_t *brick)
{
    bool inside = true;
    *brick = 0;
    for (int a = 2; a >= 0; a--) {
        float middle = 0.5f * (g->a[a] + g->b[a]), last = (float)b->n_voxel[a] - 0.5f;
        inside = inside && middle >= 0.0f && middle < (float)b->n_voxel[a];
        *brick = *brick * b->n_brick[a] + (size_t)fminf(last, fmaxf(0.0f, middle)) / b->edge;
    }
    return inside;
}

static void measure_brick(void *context, size_t i_task, size_t i_thread)
{
    struct radius_job *job = context;
    size_t i_brick = job->chosen[i_task];
    scratch_keep_within(job->v->space);
    struct distance_histogram *own = &job->histogram[i_thread * RADIUS_PARTS], *far = own + part_of(i_brick);
    float *distance2 = job->distance2 + i_thread * N_FINE;
    uint32_t *nearest = job->nearest + i_thread * N_FINE;
    struct point_lattice l = segment_brick_lattice(job->bricks, i_brick, RADIUS_UPSAMPLING);
    segment_distances(job->bricks, i_brick, &l, distance2, nearest);
    float inverse_bin = (float)(1.0 / own->bin_voxel), row[FINE];
    struct between x[FINE];
    size_t at = 0;
    for (size_t i = 0; i < l.n[0]; i++)
        x[i] = between_centres(l.origin[0] + ((float)i + 0.5f) * l.spacing, job->v->n[0]);
    for (size_t k = 0; k < l.n[2]; k++)
        for (size_t j = 0; j < l.n[1]; j++) {
            row_densities(job->v, x, l.n[0], between_centres(l.origin[1] + ((float)j + 0.5f) * l.spacing, job->v->n[1]),
                          between_centres(l.origin[2] + ((float)k + 0.5f) * l.spacing, job->v->n[2]), row);
            for (size_t i = 0; i < l.n[0]; i++, at++) {
                float density = row[i];
                size_t bin = (size_t)(sqrtf(distance2[at]) * inverse_bin);
                if (nearest[at] != UINT32_MAX && job->part[nearest[at]] == CUT_OFF) continue;
                if (nearest[at] == UINT32_MAX || bin >= RADIUS_BINS) {
                    far->far_inside += density >= job->eps_d;
                    far->far_count++;
                    far->far_density_sum += (uint64_t)(255.0f * density + 0.5f);
                    continue;
                }
                const struct segment *g = &job->bricks->segment[nearest[at]];
                struct distance_histogram *h =
                    own + job->part[nearest[at]]; /* the points near a fiber count to the same part as its length */
                uint8_t axis = g->axis;
                (density >= job->eps_d ? h->inside : h->outside)[axis][bin]++;
                h->density_sum[axis][bin] += (uint64_t)(255.0f * density + 0.5f);
            }
        }
}

static void add_histogram(struct distance_histogram *to, const struct distance_histogram *from)
{
    for (int a = 0; a < 3; a++)
        for (size_t b = 0; b < RADIUS_BINS; b++) {
            to->inside[a][b] += from->inside[a][b];
            to->outside[a][b] += from->outside[a][b];
            to->density_sum[a][b] += from->density_sum[a][b];
        }
    to->far_inside += from->far_inside;
    to->far_count += from->far_count;
    to->far_density_sum += from->far_density_sum;
    for (int a = 0; a < 3; a++) to->length_voxel[a] += from->length_voxel[a];
}

/* Chooses at most about MAX_BRICK of the bricks with fibers near them, spread evenly: millions of points suffice for
 * a mean. */
static size_t choose_bricks(const struct segment_bricks *b, uint32_t *chosen)
{
    size_t n = 0, kept = 0;
    for (size_t i = 0; i < segment_n_brick(b); i++)
        if (b->first[i + 1] > b->first[i]) chosen[n++] = (uint32_t)i;
    if (n <= MAX_BRICK) return n;
    for (size_t i = 0; i < n; i++) /* a multiplicative hash of the position chooses about MAX_BRICK of n */
        if ((uint64_t)(uint32_t)(chosen[i] * 2654435761u) * n < ((uint64_t)MAX_BRICK << 32)) chosen[kept++] = chosen[i];
    return kept;
}

/* Adds the length of the lines inside the chosen bricks. Each segment counts to the brick of its middle. */
static void add_lengths(const struct segment_bricks *bricks, const bool *is_chosen, const uint8_t *part_of_segment,
                        struct distance_histogram *part)
{
    for (size_t i = 0; i < bricks->n_segment; i++) {
        const struct segment *g = &bricks->segment[i];
        double length2 = 0.0;
        size_t brick;
        for (int a = 0; a < 3; a++) length2 += (double)((g->b[a] - g->a[a]) * (g->b[a] - g->a[a]));
        if (brick_of(bricks, g, &brick) && is_chosen[brick] && part_of_segment[i] != CUT_OFF)
            part[part_of(brick)].length_voxel[g->axis] += sqrt(length2);
    }
}

/* Segments that unknown voxels are near are left out, unless all are such. */
static void assign_parts(const struct segment_bricks *bricks, const struct volume *v, float farthest, uint8_t *part)
{
    size_t n_whole = 0;
    for (size_t i = 0; i < bricks->n_segment; i++) {
        const struct segment *g = &bricks->segment[i];
        const float middle[3] = {0.5f * (g->a[0] + g->b[0]), 0.5f * (g->a[1] + g->b[1]), 0.5f * (g->a[2] + g->b[2])};
        const bool cut_off = volume_unknown_near(v, middle, farthest);
        part[i] = cut_off ? CUT_OFF : 0;
        n_whole += !cut_off;
    }
    for (size_t i = 0; i < bricks->n_segment; i++) {
        size_t brick;
        brick_of(bricks, &bricks->segment[i], &brick);
        if (part[i] != CUT_OFF || n_whole == 0) part[i] = (uint8_t)part_of(brick);
    }
}

status distance_histogram_measure(const struct volume *v, const struct polyline_set *lines, double eps_d,
                                  double farthest_voxel, struct thread_pool *pool, const struct progress *progress,
                                  struct distance_histogram part[RADIUS_PARTS], struct error *err)
{
    struct segment_bricks bricks = {0};
    size_t n_thread = thread_pool_n_thread(pool);
    for (size_t p = 0; p < RADIUS_PARTS; p++)
        part[p] = (struct distance_histogram){.bin_voxel = farthest_voxel / RADIUS_BINS};
    struct radius_job job = {.v = v, .bricks = &bricks, .eps_d = (float)eps_d};
    status s = segment_bricks_init(&bricks, lines, v->n, BRICK, (float)farthest_voxel, err);
    job.histogram = calloc(n_thread * RADIUS_PARTS, sizeof *job.histogram);
    job.distance2 = malloc(n_thread * N_FINE * sizeof *job.distance2);
    job.nearest = malloc(n_thread * N_FINE * sizeof *job.nearest);
    uint32_t *chosen = s == STATUS_OK ? malloc(segment_n_brick(&bricks) * sizeof *chosen) : NULL;
    bool *is_chosen = s == STATUS_OK ? calloc(segment_n_brick(&bricks), sizeof *is_chosen) : NULL;
    job.chosen = chosen;
    job.part = s == STATUS_OK ? malloc(bricks.n_segment + 1) : NULL;
    if (s == STATUS_OK && (chosen == NULL || job.part == NULL || is_chosen == NULL || job.histogram == NULL ||
                           job.distance2 == NULL || job.nearest == NULL))
        s = error_set(err, STATUS_NO_MEMORY, "cannot measure the fiber radius: out of memory");
    if (s == STATUS_OK) {
        for (size_t t = 0; t < n_thread * RADIUS_PARTS; t++) job.histogram[t].bin_voxel = part[0].bin_voxel;
        size_t n_chosen = choose_bricks(&bricks, chosen);
        for (size_t i = 0; i < n_chosen; i++) is_chosen[chosen[i]] = true;
        assign_parts(&bricks, v, (float)farthest_voxel, job.part);
        s = thread_pool_run(pool, n_chosen, measure_brick, &job, progress);
        if (s != STATUS_OK) error_set(err, s, "measuring the fiber radius was cancelled");
        for (size_t t = 0; t < n_thread * RADIUS_PARTS; t++) add_histogram(&part[t % RADIUS_PARTS], &job.histogram[t]);
        add_lengths(&bricks, is_chosen, job.part, part);
    }
    free(chosen);
    free(job.part);
    free(is_chosen);
    free(job.histogram);
    free(job.distance2);
    free(job.nearest);
    segment_bricks_release(&bricks);
    return s;
}

void distance_histogram_sum(const struct distance_histogram part[RADIUS_PARTS], size_t without,
                            struct distance_histogram *sum)
{
    *sum = (struct distance_histogram){.bin_voxel = part[0].bin_voxel};
    for (size_t p = 0; p < RADIUS_PARTS; p++)
        if (p != without) add_histogram(sum, &part[p]);
}

/* Counts the points of the classes in bin b. */
static void bin_points(const struct distance_histogram *h, unsigned classes, size_t b, double *in, double *out,
                       double *density)
{
    *in = *out = *density = 0.0;
    for (unsigned a = 0; a < 3; a++)
        if ((classes >> a & 1) != 0) {
            *in += (double)h->inside[a][b];
            *out += (double)h->outside[a][b];
            *density += (double)h->density_sum[a][b] / 255.0;
        }
}

/* Counts the points of bins whose middle lies between two distances. */
static void sum_points(const struct distance_histogram *h, unsigned classes, double from, double to, double *in,
                       double *out, double *density)
{
    *in = *out = *density = 0.0;
    for (size_t b = 0; b < RADIUS_BINS; b++) {
        double middle = ((double)b + 0.5) * h->bin_voxel, i, o, d;
        if (middle < from || middle > to) continue;
        bin_points(h, classes, b, &i, &o, &d);
        *in += i;
        *out += o;
        *density += d;
    }
}

double radius_score(const struct distance_histogram *h, unsigned classes, double r_voxel)
{
    double in, out, density, total, rest;
    sum_points(h, classes, 0.0, INFINITY, &total, &rest, &density);
    sum_points(h, classes, 0.0, r_voxel, &in, &out, &density);
    return total > 0.0 ? (in - (out + (total - in))) / total : 0.0;
}

double radius_best_score(const struct distance_histogram *h, unsigned classes)
{
    double sum = 0.0, best = -INFINITY, best_r = 0.0;
    for (size_t b = 0; b < RADIUS_BINS; b++) {
        double in, out, density, r = (double)(b + 1) * h->bin_voxel;
        bin_points(h, classes, b, &in, &out, &density);
        sum += 2.0 * in - out;
        if (r < 0.25 || sum <= best) continue;
        best = sum;
        best_r = r;
    }
    return best > 0.0 ? best_r : 0.0;
}

/* Mean density of the points between two distances; fallback if there are none. */
static double mean_density(const struct distance_histogram *h, unsigned classes, double from, double to,
                           double fallback)
{
    double in, out, density;
    sum_points(h, classes, from, to, &in, &out, &density);
    return in + out > 0.0 ? density / (in + out) : fallback;
}

double radius_from_mass(const struct distance_histogram *h, unsigned classes, double r_start_voxel)
{
    double r = r_start_voxel, length = 0.0;
    for (unsigned a = 0; a < 3; a++)
        if ((classes >> a & 1) != 0) length += h->length_voxel[a];
    if (!(r > 0.0) || !(length > 0.0)) return 0.0;
    double nowhere = h->far_count > 1000 ? (double)h->far_density_sum / (255.0 * (double)h->far_count) : 0.0;
    for (int round = 0; round < 6; round++) {
        double in, out, density;
        double solid = mean_density(h, classes, 0.0, 0.4 * r, 1.0),
               empty = fmin(nowhere, mean_density(h, classes, 1.6 * r, INFINITY, nowhere));
        sum_points(h, classes, 0.0, 1.7 * r, &in, &out, &density);
        const double points_per_voxel = (double)(RADIUS_UPSAMPLING * RADIUS_UPSAMPLING * RADIUS_UPSAMPLING);
        double mass = (density - empty * (in + out)) / (solid - empty) / points_per_voxel;
        if (!(solid > empty) || !(mass > 0.0)) return r;
        r = fmin(1.5 * r_start_voxel, fmax(0.5 * r_start_voxel, sqrt(mass / (M_PI * length))));
    }
    return r;
}
