/* What makes a bent cloth impossible to look at, found before a picture is traced. */
#include "renderer/scene/bent_scene.h"

#include <math.h>
#include <string.h>

enum { MOST_HITS = 32 };

/* The nearest outer face from `origin` along `direction` beyond tnear, up to tfar. */
static bool nearest_face(const struct bent_cloth *b, const double origin[3], const double direction[3], double tnear,
                         double tfar, struct RTCRayHit *q)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    memset(q, 0, sizeof *q);
    q->ray = (struct RTCRay){.org_x = (float)origin[0],
                             .org_y = (float)origin[1],
                             .org_z = (float)origin[2],
                             .dir_x = (float)direction[0],
                             .dir_y = (float)direction[1],
                             .dir_z = (float)direction[2],
                             .tnear = (float)tnear,
                             .tfar = (float)tfar,
                             .mask = ~0u};
    q->hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(b->space.outer, &context, q);
    return q->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

bool scene_encloses(const struct scene *s, const double p_mm[3])
{
    if (s->bent == NULL) return p_mm[2] <= 0.0 && p_mm[2] >= (double)s->bottom_mm;
    /* A direction that no edge of a regular mesh runs along. */
    static const double direction[3] = {0.137, 0.211, 0.968};
    struct RTCRayHit q;
    if (!nearest_face(s->bent, p_mm, direction, 0.0, INFINITY, &q)) return false;
    return (double)q.hit.Ng_x * direction[0] + (double)q.hit.Ng_y * direction[1] + (double)q.hit.Ng_z * direction[2] >
           0.0;
}

double scene_lowest_mm(const struct scene *s)
{
    return s->bent != NULL ? s->bent->space.shell.low_mm[2] : (double)s->bottom_mm;
}

/* Whether two faces have a position of the mesh in common. Node i belongs to position i / 2. */
static bool touch(const uint32_t a[3], const uint32_t b[3])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            if (a[i] / 2 == b[k] / 2) return true;
    return false;
}

/* Whether the edge k of face f goes through a face that has no position in common with f. Two triangles that cross
 * have an edge that goes through the other one. */
static bool edge_crosses(const struct bent_cloth *b, size_t f, int k, double at_mm[3])
{
    const uint32_t *face = b->space.shell.outer[f];
    const float *from = b->space.shell.node_mm[face[k]], *to = b->space.shell.node_mm[face[(k + 1) % 3]];
    double origin[3], edge[3], t = 0.0;
    for (int a = 0; a < 3; a++) {
        origin[a] = (double)from[a];
        edge[a] = (double)to[a] - (double)from[a];
    }
    for (int i = 0; i < MOST_HITS; i++) {
        struct RTCRayHit q;
        if (!nearest_face(b, origin, edge, t, 1.0, &q)) return false;
        t = (double)q.ray.tfar;
        if (!touch(face, b->space.shell.outer[q.hit.primID])) {
            for (int a = 0; a < 3; a++) at_mm[a] = origin[a] + t * edge[a];
            return true;
        }
        t += 1e-5; /* of the edge: on to the next face */
    }
    return false;
}

bool scene_crosses_itself(const struct scene *s, double at_mm[3])
{
    if (s->bent == NULL) return false;
    for (size_t f = 0; f < s->bent->space.shell.n_outer; f++)
        for (int k = 0; k < 3; k++) {
            const uint32_t *face = s->bent->space.shell.outer[f];
            if (face[k] > face[(k + 1) % 3]) continue; /* the neighbour has the same edge the other way */
            if (edge_crosses(s->bent, f, k, at_mm)) return true;
        }
    return false;
}
