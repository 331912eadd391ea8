#include "renderer/fast/precompute/sphere_distance.h"

#include <math.h>
#include <string.h>

enum { N = FAST_N_PICTURE, N_SWEEP = 2 };

void sphere_directions_init(struct sphere_directions *s)
{
    for (int i = 0; i < N; i++) {
        double theta = M_PI * (i + 0.5) / N;
        s->solid_angle[i] = (float)(2.0 * M_PI / N * (cos(M_PI * i / N) - cos(M_PI * (i + 1) / N)));
        for (int j = 0; j < N; j++) {
            double phi = 2.0 * M_PI * (j + 0.5) / N;
            float *d = s->direction[i * N + j];
            d[0] = (float)(sin(theta) * cos(phi));
            d[1] = (float)(sin(theta) * sin(phi));
            d[2] = (float)cos(theta);
        }
    }
}

struct field {
    const struct sphere_directions *s;
    const uint8_t *picture;
    int16_t nearest[SPHERE_PIXEL]; /* pixel of the other kind; -1: none found yet */
    float cosine[SPHERE_PIXEL];    /* to it */
};

static inline void offer(struct field *f, int p, int q)
{
    if (q < 0) return;
    const float *a = f->s->direction[p], *b = f->s->direction[q];
    float c = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if (f->nearest[p] >= 0 && c <= f->cosine[p]) return;
    f->nearest[p] = (int16_t)q;
    f->cosine[p] = c;
}

/* The candidate that a neighbour q has for pixel p: itself, if it is of the other kind, or its own nearest pixel. */
static inline void ask(struct field *f, int p, int q)
{
    offer(f, p, f->picture[p] != f->picture[q] ? q : f->nearest[q]);
}

static void ask_all(struct field *f, int i, int j)
{
    int p = i * N + j;
    for (int di = -1; di <= 1; di++)
        for (int dj = -1; dj <= 1; dj++) {
            int row = i + di, column = j + dj;
            if (di == 0 && dj == 0) continue;
            if (row < 0 || row >= N) { /* beyond a pole */
                row = i;
                column += N / 2;
            }
            ask(f, p, row * N + (column + N) % N);
        }
}

void sphere_distance(const struct sphere_directions *s, const uint8_t picture[SPHERE_PIXEL],
                     float distance_rad[SPHERE_GRID])
{
    struct field f = {.s = s, .picture = picture};
    memset(f.nearest, -1, sizeof f.nearest);
    for (int sweep = 0; sweep < N_SWEEP; sweep++) {
        for (int i = 0; i < N; i++) {
            for (int j = 0; j < N; j++) ask_all(&f, i, j);
            for (int j = N - 1; j >= 0; j--) ask_all(&f, i, j);
        }
        for (int i = N - 1; i >= 0; i--) {
            for (int j = N - 1; j >= 0; j--) ask_all(&f, i, j);
            for (int j = 0; j < N; j++) ask_all(&f, i, j);
        }
    }
    for (int i = 0; i < FAST_N_GRID; i++)
        for (int j = 0; j < FAST_N_GRID; j++) {
            float sum = 0;
            for (int k = 0; k < 4; k++) {
                int p = (2 * i + k / 2) * N + 2 * j + k % 2;
                float d = f.nearest[p] < 0 ? (float)M_PI : acosf(fminf(1, f.cosine[p]));
                sum += picture[p] != 0 ? d : -d;
            }
            distance_rad[i * FAST_N_GRID + j] = 0.25f * sum;
        }
}
