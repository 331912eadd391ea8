/* Rays that visit all fibers ahead. */
#include "renderer/scene/scene_visitor.h"

#include "renderer/scene/scene_data.h"

#include <math.h>

void scene_visitor_init(struct scene_visitor *v, const struct scene *flat, const float direction[3], scene_visit *visit,
                        void *context)
{
    *v = (struct scene_visitor){.flat = flat, .visit = visit, .context = context};
    for (int a = 0; a < 3; a++) v->direction[a] = direction[a];
}

bool scene_visitor_see(struct scene_visitor *v, uint32_t i_segment)
{
    const struct scene *s = v->flat;
    const struct scene_vertex *p = &s->vertex[s->segment_vertex[i_segment]];
    const float flat[3] = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z};
    float along = 0, length2 = 0;
    for (int i = 0; i < 3; i++) {
        const float *row = v->to_seen[i];
        float t = v->to_seen[0] != NULL ? row[0] * flat[0] + row[1] * flat[1] + row[2] * flat[2] : flat[i];
        along += t * v->direction[i];
        length2 += t * t;
    }
    v->stopped = !v->visit(v->context, i_segment, along / sqrtf(length2));
    return !v->stopped;
}
