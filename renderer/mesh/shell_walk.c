#include "renderer/mesh/shell_walk.h"

#include <math.h>
#include <string.h>

enum { MOST_STEPS = 16 };

static inline double plane_at(const double p[4], const double x[3])
{
    return p[0] * x[0] + p[1] * x[1] + p[2] * x[2] + p[3];
}

static inline double along(const double p[4], const double d[3]) { return p[0] * d[0] + p[1] * d[1] + p[2] * d[2]; }

void shell_walk_point(const struct shell_walk *w, double t, double x[3])
{
    for (int a = 0; a < 3; a++) x[a] = w->origin[a] + t * w->direction[a];
}

void shell_walk_find_start(struct shell_walk *w)
{
    double x[3];
    shell_walk_point(w, w->t, x);
    for (int i = 0; i < MOST_STEPS; i++) {
        const struct shell_cell *c = &w->space->shell.cell[w->i_cell];
        int worst = 0;
        double least = INFINITY;
        for (int k = 0; k < 4; k++) {
            double at = plane_at(c->plane[k], x);
            if (at < least) {
                least = at;
                worst = k;
            }
        }
        if (least >= -1e-9 || c->neighbour[worst] == SHELL_NONE) return;
        w->i_cell = c->neighbour[worst];
    }
}

double shell_walk_exit(const struct shell_walk *w, int *face)
{
    const struct shell_cell *c = &w->space->shell.cell[w->i_cell];
    double t = INFINITY;
    *face = -1;
    for (int k = 0; k < 4; k++) {
        double rate = along(c->plane[k], w->direction);
        if (k == w->from_face || !(rate < 0.0)) continue;
        double at = -plane_at(c->plane[k], w->origin) / rate;
        if (at < t) {
            t = at;
            *face = k;
        }
    }
    return t > w->t ? t : w->t;
}

static int face_towards(const struct shell_cell *c, uint32_t i_cell)
{
    for (int k = 0; k < 4; k++)
        if (c->neighbour[k] == i_cell) return k;
    return -1;
}

bool shell_walk_enter(struct shell_walk *w)
{
    struct RTCIntersectContext context;
    struct RTCRayHit q;
    rtcInitIntersectContext(&context);
    double start = w->t;
    for (int i = 0; i < MOST_STEPS; i++) {
        double x[3];
        shell_walk_point(w, start, x);
        memset(&q, 0, sizeof q);
        q.ray = (struct RTCRay){.org_x = (float)x[0],
                                .org_y = (float)x[1],
                                .org_z = (float)x[2],
                                .dir_x = (float)w->direction[0],
                                .dir_y = (float)w->direction[1],
                                .dir_z = (float)w->direction[2],
                                .tfar = INFINITY,
                                .mask = ~0u};
        q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(w->space->outer, &context, &q);
        if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
        uint32_t f = q.hit.primID;
        double inwards = (double)q.hit.Ng_x * w->direction[0] + (double)q.hit.Ng_y * w->direction[1] +
                         (double)q.hit.Ng_z * w->direction[2];
        start += (double)q.ray.tfar;
        if (inwards < 0.0) {
            w->t = start;
            w->i_cell =
                w->black_sheet && w->space->shell.outer_bottom[f] ? SHELL_ON_SHEET : w->space->shell.outer_cell[f];
            w->from_face = -1;
            return w->i_cell != SHELL_ON_SHEET;
        }
        start += 1e-6 * (1.0 + fabs(start)); /* a way out, which rounding has put before the ray */
    }
    return false;
}

void shell_walk_on(struct shell_walk *w, double t, int face)
{
    const struct shell_cell *c = &w->space->shell.cell[w->i_cell];
    uint32_t next = face >= 0 ? c->neighbour[face] : SHELL_NONE;
    w->t = t;
    if (next == SHELL_NONE) {
        bool sheet = face >= 0 && (c->bottom >> face & 1) != 0 && w->black_sheet;
        w->i_cell = sheet ? SHELL_ON_SHEET : SHELL_OUTSIDE;
        w->t += SHELL_OVERLAP_MM;
        return;
    }
    w->from_face = face_towards(&w->space->shell.cell[next], w->i_cell);
    w->i_cell = next;
}

void shell_walk_flat(const struct shell_walk *w, double p_mm[3], double d[3])
{
    const struct shell_cell *c = &w->space->shell.cell[w->i_cell];
    double x[3];
    shell_walk_point(w, w->t, x);
    for (int a = 0; a < 3; a++) {
        p_mm[a] = plane_at(c->to_cloth[a], x);
        d[a] = along(c->to_cloth[a], w->direction);
    }
}
