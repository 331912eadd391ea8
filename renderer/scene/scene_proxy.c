#include "renderer/scene/scene_proxy.h"
#include "renderer/scene/bent_scene.h"

#include <math.h>
#include <string.h>

static void unit(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int a = 0; a < 3 && length > 0.0; a++) v[a] /= length;
}

/* normal: the mean of the way from the lower to the upper end at the corners of a face. upper: the mean of the upper
 * ends. Nodes 2 i and 2 i + 1 are the two ends of position i. */
static void normal_at(const struct shell *s, const uint32_t node[3], const float uv[2], double normal[3],
                      double upper[3])
{
    const double share[3] = {1.0 - (double)uv[0] - (double)uv[1], (double)uv[0], (double)uv[1]};
    for (int a = 0; a < 3; a++) normal[a] = upper[a] = 0.0;
    for (int k = 0; k < 3; k++) {
        const float *low = s->node_mm[node[k] & ~1u], *high = s->node_mm[node[k] | 1u];
        double way[3];
        for (int a = 0; a < 3; a++) way[a] = (double)high[a] - (double)low[a];
        unit(way);
        for (int a = 0; a < 3; a++) {
            normal[a] += share[k] * way[a];
            upper[a] += share[k] * (double)high[a];
        }
    }
    unit(normal);
}

static bool is_cut_edge(const uint32_t node[3])
{
    return (node[0] & 1u) != (node[1] & 1u) || (node[0] & 1u) != (node[2] & 1u);
}

static void weft_at(const struct shell_cell *c, const double normal[3], double weft[3])
{
    double along = 0.0;
    for (int a = 0; a < 3; a++) along += (double)c->to_world[a][0] * normal[a];
    for (int a = 0; a < 3; a++) weft[a] = (double)c->to_world[a][0] - along * normal[a];
    unit(weft);
}

bool scene_proxy_trace(const struct scene *scene, const double o[3], const double d[3], double from_mm,
                       struct scene_proxy_hit *hit)
{
    const struct shell_space *space = &scene->bent->space;
    struct RTCIntersectContext context;
    struct RTCRayHit q = {.ray = {.org_x = (float)o[0],
                                  .org_y = (float)o[1],
                                  .org_z = (float)o[2],
                                  .dir_x = (float)d[0],
                                  .dir_y = (float)d[1],
                                  .dir_z = (float)d[2],
                                  .tnear = (float)from_mm,
                                  .tfar = INFINITY,
                                  .mask = ~0u},
                          .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
    rtcInitIntersectContext(&context);
    rtcIntersect1(space->outer, &context, &q);
    if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    const uint32_t face = q.hit.primID, *node = space->shell.outer[face];
    double upper[3];
    hit->distance_mm = (double)q.ray.tfar;
    hit->lower = space->shell.outer_bottom[face];
    for (int a = 0; a < 3; a++) hit->position_mm[a] = o[a] + hit->distance_mm * d[a];
    normal_at(&space->shell, node, (const float[2]){q.hit.u, q.hit.v}, hit->normal, upper);
    if (is_cut_edge(node)) memcpy(hit->position_mm, upper, sizeof upper);
    weft_at(&space->shell.cell[space->shell.outer_cell[face]], hit->normal, hit->weft);
    return true;
}

double scene_proxy_edge_mm(const struct scene *scene)
{
    const struct shell *s = &scene->bent->space.shell;
    double sum = 0.0;
    size_t n = 0;
    for (size_t i = 0; i < s->n_outer; i++) {
        double shortest = INFINITY;
        if (s->outer_bottom[i]) continue;
        for (int k = 0; k < 3; k++) {
            const float *p = s->node_mm[s->outer[i][k]], *q = s->node_mm[s->outer[i][(k + 1) % 3]];
            shortest = fmin(shortest, (double)hypotf(hypotf(p[0] - q[0], p[1] - q[1]), p[2] - q[2]));
        }
        sum += shortest;
        n++;
    }
    return n > 0 ? sum / (double)n : 0.0;
}
