#include "geometry/filter/direction_set.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static float dot3(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void tangent_frame(const float d[3], float e1[3], float e2[3])
{
    int a = fabsf(d[0]) < 0.6f ? 0 : 1; /* an axis that is not nearly parallel to d */
    float c = d[a], norm = 1.0f / sqrtf(1.0f - c * c);
    for (int b = 0; b < 3; b++) e1[b] = ((b == a ? 1.0f : 0.0f) - c * d[b]) * norm;
    e2[0] = d[1] * e1[2] - d[2] * e1[1];
    e2[1] = d[2] * e1[0] - d[0] * e1[2];
    e2[2] = d[0] * e1[1] - d[1] * e1[0];
}

/* Coordinates of direction b in the tangent plane at a (azimuthal equidistant projection), with the sign of b nearer
 * to a. */
static void tangent_coordinates(const struct direction_node *a, const float b[3], double u[2])
{
    float c = dot3(a->d, b), sign = c < 0.0f ? -1.0f : 1.0f;
    double x = sign * dot3(a->e1, b), y = sign * dot3(a->e2, b), r = sqrt(x * x + y * y);
    double angle = atan2(r, (double)fabsf(c)), scale = r > 0.0 ? angle / r : 0.0;
    u[0] = x * scale;
    u[1] = y * scale;
}

static void find_neighbours(struct direction_set *s, size_t i)
{
    float best[DIRECTION_NEIGHBOURS];
    size_t n = 0;
    for (size_t j = 0; j < s->n; j++) {
        if (j == i) continue;
        float c = fabsf(dot3(s->node[i].d, s->node[j].d));
        if (n == DIRECTION_NEIGHBOURS && c <= best[n - 1]) continue;
        size_t at = n < DIRECTION_NEIGHBOURS ? n++ : n - 1;
        for (; at > 0 && best[at - 1] < c; at--) {
            best[at] = best[at - 1];
            s->node[i].neighbour[at] = s->node[i].neighbour[at - 1];
        }
        best[at] = c;
        s->node[i].neighbour[at] = (uint16_t)j;
    }
    s->node[i].reach = acosf(fminf(1.0f, best[n - 1]));
}

static void prepare_fit(struct direction_set *s, size_t i)
{
    double basis[DIRECTION_NEIGHBOURS][5], normal[5][5] = {{0.0}}, right[5][DIRECTION_NEIGHBOURS];
    double scale = 1.0 / s->node[i].reach; /* for the conditioning of the system */
    for (int k = 0; k < DIRECTION_NEIGHBOURS; k++) {
        double u[2];
        tangent_coordinates(&s->node[i], s->node[s->node[i].neighbour[k]].d, u);
        double x = u[0] * scale, y = u[1] * scale;
        const double row[5] = {x, y, 0.5 * x * x, x * y, 0.5 * y * y};
        memcpy(basis[k], row, sizeof row);
        for (int r = 0; r < 5; r++) {
            right[r][k] = row[r];
            for (int c = 0; c < 5; c++) normal[r][c] += row[r] * row[c];
        }
    }
    for (int r = 0; r < 5; r++) normal[r][r] += 1e-6;
    (void)small_factor(&normal[0][0], 5, 0.0); /* positive definite because of the 1e-6 above */
    for (int k = 0; k < DIRECTION_NEIGHBOURS; k++) small_solve(&normal[0][0], 5, &right[0][k], DIRECTION_NEIGHBOURS);
    for (int r = 0; r < 5; r++)
        for (int k = 0; k < DIRECTION_NEIGHBOURS; k++)
            s->node[i].fit[r][k] = (float)(right[r][k] * (r < 2 ? scale : scale * scale));
}

status direction_set_init(struct direction_set *s, size_t n, struct error *err)
{
    *s = (struct direction_set){0};
    if (n < 32 || n > UINT16_MAX) return error_set(err, STATUS_INVALID, "cannot make a set of %zu directions", n);
    s->node = calloc(n, sizeof *s->node);
    for (int a = 0; a < 3; a++) s->component[a] = malloc(n * sizeof *s->component[a]);
    if (s->node == NULL || s->component[0] == NULL || s->component[1] == NULL || s->component[2] == NULL) {
        direction_set_release(s);
        return error_set(err, STATUS_NO_MEMORY, "cannot make a set of %zu directions: out of memory", n);
    }
    s->n = n;
    const double golden = M_PI * (3.0 - sqrt(5.0));
    for (size_t i = 0; i < n; i++) {
        double z = 1.0 - ((double)i + 0.5) / (double)n, r = sqrt(1.0 - z * z), phi = golden * (double)i;
        struct direction_node *node = &s->node[i];
        node->d[0] = (float)(r * cos(phi));
        node->d[1] = (float)(r * sin(phi));
        node->d[2] = (float)z;
        tangent_frame(node->d, node->e1, node->e2);
        for (int a = 0; a < 3; a++) s->component[a][i] = node->d[a];
    }
    for (size_t i = 0; i < n; i++) {
        find_neighbours(s, i);
        prepare_fit(s, i);
    }
    return STATUS_OK;
}

void direction_set_release(struct direction_set *s)
{
    if (s == NULL) return;
    free(s->node);
    for (int a = 0; a < 3; a++) free(s->component[a]);
    *s = (struct direction_set){0};
}

/* |c| as an integer of the same order, because the largest of floats is not found in vector registers. */
static int32_t order_of(float c)
{
    int32_t bits;
    c = fabsf(c);
    memcpy(&bits, &c, sizeof bits);
    return bits;
}

size_t direction_set_nearest(const struct direction_set *s, const float d[3])
{
    const float *x = s->component[0], *y = s->component[1], *z = s->component[2], a = d[0], b = d[1], c = d[2];
    int32_t most = 0;
    for (size_t i = 0; i < s->n; i++) {
        int32_t order = order_of(x[i] * a + y[i] * b + z[i] * c);
        most = order > most ? order : most;
    }
    size_t best = 0;
    while (best + 1 < s->n && order_of(x[best] * a + y[best] * b + z[best] * c) != most) best++;
    return best;
}

void direction_set_refine(const struct direction_set *s, size_t i, float value_0,
                          const float value[DIRECTION_NEIGHBOURS], float d[3])
{
    const struct direction_node *node = &s->node[i];
    float c[5] = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
    for (int k = 0; k < DIRECTION_NEIGHBOURS; k++)
        for (int r = 0; r < 5; r++) c[r] += node->fit[r][k] * (value[k] - value_0);
    float det = c[2] * c[4] - c[3] * c[3], u = 0.0f, v = 0.0f;
    if (c[2] > 0.0f && det > 0.0f) { /* the paraboloid has a minimum */
        u = (c[3] * c[1] - c[4] * c[0]) / det;
        v = (c[3] * c[0] - c[2] * c[1]) / det;
    }
    float length = sqrtf(u * u + v * v), limit = 0.5f * node->reach;
    if (length > limit) {
        u *= limit / length;
        v *= limit / length;
        length = limit;
    }
    float sine = length > 1e-6f ? sinf(length) / length : 1.0f, cosine = cosf(length);
    for (int a = 0; a < 3; a++) d[a] = cosine * node->d[a] + sine * (u * node->e1[a] + v * node->e2[a]);
}
