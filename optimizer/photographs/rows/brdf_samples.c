#include "optimizer/photographs/rows/brdf_samples.h"

#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_NEAR = 16, N_AXIS = 6, MAX_CANDIDATES = 20000 };
static const double farthest = 0.2, farthest_slow = 0.8, slow = 0.15, ridge = 1e-3, least_cosine = 0.17364817766693033;

static void pair_vectors(const double light[3], const double camera[3], double v[N_AXIS])
{
    for (size_t i = 0; i < 3; i++) {
        v[i] = light[i] + camera[i];
        v[3 + i] = slow * (light[i] - camera[i]);
    }
}

/* The equivalent of q that comes nearest to p, by reciprocity and, for isotropic BRDFs, turns and mirrors. */
static double nearest_form(bool isotropic, const double p[N_AXIS], const double q[N_AXIS], double form[N_AXIS])
{
    double best = INFINITY;
    for (int k = 0; k < (isotropic ? 4 : 2); k++) {
        double sign = k & 1 ? -1.0 : 1.0, mirror = k & 2 ? -1.0 : 1.0, d2 = 0.0, turn[2] = {1.0, 0.0}, at[N_AXIS];
        for (size_t i = 0; i < N_AXIS; i++) at[i] = q[i] * (i >= 3 ? sign : 1.0) * (i % 3 == 1 ? mirror : 1.0);
        if (isotropic) { /* the turn of least squared distance */
            double c = p[0] * at[0] + p[1] * at[1] + p[3] * at[3] + p[4] * at[4];
            double s = p[1] * at[0] - p[0] * at[1] + p[4] * at[3] - p[3] * at[4];
            double length = hypot(c, s);
            if (length > 0.0) {
                turn[0] = c / length;
                turn[1] = s / length;
            }
        }
        for (size_t i = 0; i < N_AXIS; i += 3) {
            double x = turn[0] * at[i] - turn[1] * at[i + 1], y = turn[1] * at[i] + turn[0] * at[i + 1];
            at[i] = x;
            at[i + 1] = y;
        }
        for (size_t i = 0; i < N_AXIS; i++) d2 += (p[i] - at[i]) * (p[i] - at[i]);
        if (d2 >= best) continue;
        best = d2;
        memcpy(form, at, sizeof at);
    }
    return best;
}

double brdf_samples_distance(bool isotropic, const struct brdf_sample *p, const struct brdf_sample *q)
{
    double a[N_AXIS], b[N_AXIS], form[N_AXIS];
    pair_vectors(p->light, p->camera, a);
    pair_vectors(q->light, q->camera, b);
    return sqrt(nearest_form(isotropic, a, b, form));
}

static double height_of(const struct brdf_sample *s) { return s->light[2] + s->camera[2]; }

/* By height, then by all numbers, so that the order does not depend on the order in the file. */
static int compare(const void *left, const void *right)
{
    const struct brdf_sample *p = left, *q = right;
    double a[10] = {height_of(p)}, b[10] = {height_of(q)};
    memcpy(a + 1, p, 9 * sizeof *a);
    memcpy(b + 1, q, 9 * sizeof *b);
    for (size_t i = 0; i < 10; i++)
        if (a[i] < b[i] || a[i] > b[i]) return a[i] < b[i] ? -1 : 1;
    return 0;
}

void brdf_samples_sort(struct brdf_samples *s) { qsort(s->item, s->n, sizeof *s->item, compare); }

struct near_sample {
    double distance2, offset[N_AXIS];
    const struct brdf_sample *sample;
};

struct near_list {
    size_t n;
    struct near_sample item[N_NEAR + 1]; /* the last one sets where weights end */
};

static void near_add(struct near_list *list, const struct brdf_samples *s, size_t i, const double at[N_AXIS])
{
    struct near_sample one = {.sample = &s->item[i]};
    double v[N_AXIS], form[N_AXIS];
    pair_vectors(one.sample->light, one.sample->camera, v);
    one.distance2 = nearest_form(s->isotropic, at, v, form);
    if (list->n == N_NEAR + 1 && one.distance2 >= list->item[N_NEAR].distance2) return;
    for (size_t k = 0; k < N_AXIS; k++) one.offset[k] = form[k] - at[k];
    size_t place = list->n < N_NEAR + 1 ? list->n++ : N_NEAR;
    for (; place > 0 && list->item[place - 1].distance2 > one.distance2; place--)
        list->item[place] = list->item[place - 1];
    list->item[place] = one;
}

/* Looks from the height of the pair up and down, as long as a difference of heights alone is nearer than the farthest
 * kept sample. */
static void find_near(const struct brdf_samples *s, const double at[N_AXIS], struct near_list *list)
{
    size_t low = 0, high = s->n;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (height_of(&s->item[middle]) < at[2])
            low = middle + 1;
        else
            high = middle;
    }
    size_t up = low, down = low;
    for (;;) {
        double above = up < s->n ? height_of(&s->item[up]) - at[2] : INFINITY;
        double below = down > 0 ? at[2] - height_of(&s->item[down - 1]) : INFINITY;
        double least = fmin(above, below);
        if (isinf(least) || least > farthest * 2.0) return;
        if (list->n == N_NEAR + 1 && least * least > list->item[N_NEAR].distance2) return;
        near_add(list, s, above <= below ? up++ : --down, at);
    }
}

/* Value at the origin of a plane through the samples: mean and slopes, where small slopes cost little. */
static void plane_value(const struct near_list *list, size_t n, const double *weight, double f_rgb[3])
{
    double matrix[N_AXIS * N_AXIS] = {0}, slope[3][N_AXIS] = {{0}}, mean[N_AXIS] = {0}, sum = 0.0, size = 0.0;
    memset(f_rgb, 0, 3 * sizeof *f_rgb);
    for (size_t i = 0; i < n; i++) {
        sum += weight[i];
        for (size_t k = 0; k < N_AXIS; k++) mean[k] += weight[i] * list->item[i].offset[k];
        for (size_t c = 0; c < 3; c++) f_rgb[c] += weight[i] * list->item[i].sample->f_rgb[c];
    }
    for (size_t k = 0; k < N_AXIS; k++) mean[k] /= sum;
    for (size_t c = 0; c < 3; c++) f_rgb[c] /= sum;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < N_AXIS; j++) {
            double x = list->item[i].offset[j] - mean[j];
            size += weight[i] * x * x;
            for (size_t k = 0; k <= j; k++)
                matrix[j * N_AXIS + k] += weight[i] * x * (list->item[i].offset[k] - mean[k]);
            for (size_t c = 0; c < 3; c++) slope[c][j] += weight[i] * x * (list->item[i].sample->f_rgb[c] - f_rgb[c]);
        }
    for (size_t k = 0; k < N_AXIS; k++) matrix[k * N_AXIS + k] += ridge * size;
    if (!(size > 0.0) || !small_factor(matrix, N_AXIS, 0.0)) return;
    for (size_t c = 0; c < 3; c++) {
        small_solve(matrix, N_AXIS, slope[c], 1);
        for (size_t k = 0; k < N_AXIS; k++) f_rgb[c] -= slope[c][k] * mean[k];
    }
}

static bool is_near(const struct near_sample *p)
{
    double fast2 = 0.0, slow2 = 0.0;
    for (size_t i = 0; i < 3; i++) {
        fast2 += p->offset[i] * p->offset[i];
        slow2 += p->offset[3 + i] * p->offset[3 + i] / (slow * slow);
    }
    return fast2 <= farthest * farthest && slow2 <= farthest_slow * farthest_slow;
}

bool brdf_samples_value(const struct brdf_samples *s, const double light[3], const double camera[3], double f_rgb[3])
{
    struct near_list list = {0};
    double at[N_AXIS], weight[N_NEAR];
    pair_vectors(light, camera, at);
    find_near(s, at, &list);
    if (list.n == 0 || !is_near(&list.item[0])) return false;
    size_t n = list.n < N_NEAR ? list.n : N_NEAR;
    double reach = 1.0001 * sqrt(list.item[list.n - 1].distance2);
    if (list.n <= N_NEAR) reach *= 1.5;
    for (size_t i = 0; i < n; i++) {
        double d = sqrt(list.item[i].distance2);
        if (d < 1e-6) { /* at a sample */
            memcpy(f_rgb, list.item[i].sample->f_rgb, sizeof list.item[i].sample->f_rgb);
            return true;
        }
        weight[i] = (reach - d) / (reach * d) * ((reach - d) / (reach * d));
    }
    plane_value(&list, n, weight, f_rgb);
    for (size_t c = 0; c < 3; c++) {
        double least = INFINITY, most = 0.0;
        for (size_t i = 0; i < n; i++) {
            least = fmin(least, list.item[i].sample->f_rgb[c]);
            most = fmax(most, list.item[i].sample->f_rgb[c]);
        }
        f_rgb[c] = fmin(fmax(f_rgb[c], least), most);
    }
    return true;
}

/* The candidate of the largest distance to the chosen ones, after `last` has been chosen. */
static size_t farthest_of(const struct brdf_samples *s, const struct brdf_sample *last, size_t step, double *distance)
{
    size_t best = s->n;
    double most = 1e-3;
    for (size_t i = 0; i < s->n; i += step) {
        const struct brdf_sample *p = &s->item[i];
        if (p->light[2] < least_cosine || p->camera[2] < least_cosine) continue;
        distance[i / step] = fmin(distance[i / step], brdf_samples_distance(s->isotropic, last, p));
        if (distance[i / step] <= most) continue;
        most = distance[i / step];
        best = i;
    }
    return best;
}

size_t brdf_samples_spread(const struct brdf_samples *s, const struct brdf_sample *first, size_t n_wanted,
                           size_t *chosen)
{
    size_t n = 0, step = s->n / MAX_CANDIDATES + 1, best = s->n;
    double *distance = malloc((s->n / step + 1) * sizeof *distance), least = INFINITY;
    if (distance == NULL) return 0;
    for (size_t i = 0; i < s->n; i += step) {
        double d = brdf_samples_distance(s->isotropic, first, &s->item[i]);
        bool counts = s->item[i].light[2] >= least_cosine && s->item[i].camera[2] >= least_cosine;
        distance[i / step] = INFINITY;
        if (!counts || d >= least) continue;
        least = d;
        best = i;
    }
    while (best < s->n && n < n_wanted) {
        chosen[n++] = best;
        best = farthest_of(s, &s->item[best], step, distance);
    }
    free(distance);
    return n;
}
