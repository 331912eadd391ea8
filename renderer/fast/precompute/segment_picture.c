#include "renderer/fast/precompute/segment_picture.h"
#include "renderer/scene/scene_place.h"

#include <string.h>

enum { N = FAST_N_PICTURE, COARSE = 8, UNKNOWN = 255 };

struct look {
    const struct scene *scene;
    const struct sphere_directions *s;
    struct scene_segment segment;
    uint8_t *picture;
};

static bool sees(const struct look *l, int pixel)
{
    const float *d = l->s->direction[pixel];
    if (scene_sheet_hides(l->scene, d)) return false;
    struct scene_ray ray = {.inside = true, .i_from = SCENE_NO_SEGMENT};
    memcpy(ray.origin_mm, l->segment.middle_mm, sizeof ray.origin_mm);
    memcpy(ray.direction, d, sizeof ray.direction);
    return !scene_occluded(l->scene, &ray);
}

static uint8_t at(const struct look *l, int i, int j)
{
    int p = i * N + (j % N);
    if (l->picture[p] == UNKNOWN) l->picture[p] = sees(l, p);
    return l->picture[p];
}

bool segment_sees(const struct scene *flat, const struct sphere_directions *s, uint32_t i_segment)
{
    struct look l = {.scene = flat, .s = s};
    scene_segment_at(flat, i_segment, &l.segment);
    for (int i = COARSE / 2; i < N; i += COARSE)
        for (int j = COARSE / 2; j < N; j += COARSE)
            if (sees(&l, i * N + j)) return true;
    return false;
}

/* The block with corners (i, j) and (i + n, j + n), of which all but the lower and right edge are filled. The last row
 * of the picture has no row behind it, and is its own. */
static void fill(const struct look *l, int i, int j, int n)
{
    int below = i + n < N ? i + n : N - 1;
    uint8_t a = at(l, i, j);
    if (n == 1) return;
    if (at(l, i, j + n) == a && at(l, below, j) == a && at(l, below, j + n) == a) {
        for (int y = i; y < i + n; y++)
            for (int x = j; x < j + n; x++)
                if (l->picture[y * N + x] == UNKNOWN) l->picture[y * N + x] = a;
        return;
    }
    int half = n / 2;
    fill(l, i, j, half);
    fill(l, i, j + half, half);
    fill(l, i + half, j, half);
    fill(l, i + half, j + half, half);
}

void segment_picture(const struct scene *flat, const struct sphere_directions *s, uint32_t i_segment,
                     uint8_t picture[SPHERE_PIXEL])
{
    struct look l = {.scene = flat, .s = s, .picture = picture};
    scene_segment_at(flat, i_segment, &l.segment);
    memset(picture, UNKNOWN, SPHERE_PIXEL);
    for (int i = 0; i < N; i += COARSE)
        for (int j = 0; j < N; j += COARSE) fill(&l, i, j, COARSE);
}
