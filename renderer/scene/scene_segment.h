/* Where a ray comes into a round segment: the convex hull of the balls around both ends. Inside of struct scene. */
#ifndef SELVEDGE_RENDERER_SCENE_SEGMENT_H
#define SELVEDGE_RENDERER_SCENE_SEGMENT_H

#include "renderer/scene/scene_data.h"

#include <math.h>

static inline float segment_dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Where the line comes into the ball around p + along u; INFINITY: nowhere. */
static inline float segment_meet_ball(const float p[3], const float u[3], float along, float radius, const float d[3],
                                      float d2)
{
    const float q[3] = {p[0] - along * u[0], p[1] - along * u[1], p[2] - along * u[2]}, b = segment_dot(q, d),
                root2 = b * b - d2 * (segment_dot(q, q) - radius * radius);
    return root2 < 0 ? INFINITY : (-b - sqrtf(root2)) / d2;
}

/* Where the line o + t d comes into the segment. o: from its first end; d2 = d d. INFINITY: nowhere. */
static inline float segment_meet(const struct scene_vertex v[2], const float o[3], const float d[3], float d2)
{
    const float a[3] = {v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z}, length = sqrtf(segment_dot(a, a)),
                inv = 1 / length, near = (0.5f * segment_dot(a, d) - segment_dot(o, d)) / d2,
                k = (v[1].radius - v[0].radius) * inv, c2 = 1 - k * k;
    float u[3], p[3], p_off[3], d_off[3]; /* p: from the first end, the place on the line nearest to the middle */
    for (int i = 0; i < 3; i++) {
        u[i] = a[i] * inv;
        p[i] = o[i] + near * d[i];
    }
    const float pu = segment_dot(p, u), du = segment_dot(d, u);
    for (int i = 0; i < 3; i++) {
        p_off[i] = p[i] - pu * u[i];
        d_off[i] = d[i] - du * u[i];
    }
    /* (distance from the axis)^2 c2 = (r0 + k place)^2: t^2 s + 2 t h + w = 0 */
    const float r = v[0].radius + k * pu, r_rate = k * du, s = c2 * segment_dot(d_off, d_off) - r_rate * r_rate,
                h = c2 * segment_dot(p_off, d_off) - r * r_rate, w = c2 * segment_dot(p_off, p_off) - r * r,
                root2 = h * h - s * w;
    if (s > 1e-6f * d2) {
        if (root2 < 0) return INFINITY;
        const float t = (-h - sqrtf(root2)) / s, place = (pu + t * du + k * v[0].radius) / c2;
        if (place >= 0 && place <= length) return near + t;
        return near + segment_meet_ball(p, u, place < 0 ? 0 : length, v[place < 0 ? 0 : 1].radius, d, d2);
    }
    /* nearly along the axis: the first of all places where the line may come in */
    float first =
        fminf(segment_meet_ball(p, u, 0, v[0].radius, d, d2), segment_meet_ball(p, u, length, v[1].radius, d, d2));
    for (int sign = -1; sign <= 1 && c2 > 0 && root2 >= 0 && s != 0; sign += 2) {
        const float t = (-h + (float)sign * sqrtf(root2)) / s, place = (pu + t * du + k * v[0].radius) / c2;
        if (place >= 0 && place <= length) first = fminf(first, t);
    }
    return near + first;
}

#endif
