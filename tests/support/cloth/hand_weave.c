#include "tests/support/cloth/hand_weave.h"

#include <math.h>
#include <stdlib.h>

static void start(struct fiber_set *f, size_t n_fiber, size_t n_segment, double tile_m, double radius_m)
{
    fiber_set_init(f);
    if (fiber_set_reserve(f, n_fiber, n_fiber * (n_segment + 1), NULL) != STATUS_OK) abort();
    for (size_t i = 0; i <= n_fiber; i++) f->first_vertex[i] = i * (n_segment + 1);
    for (size_t i = 0; i < n_fiber; i++) {
        f->radius_m[i] = (float)radius_m;
        f->axis_class[i] = 0;
    }
    f->tile_size_m[0] = f->tile_size_m[1] = tile_m;
}

void hand_weave(struct fiber_set *f, const struct hand_weave_option *o)
{
    start(f, 2 * o->n_yarn * o->n_strand, o->n_segment, o->tile_m, o->fiber_radius_m);
    double pitch = o->tile_m / (double)o->n_yarn;
    double half_width = 0.46 * pitch - o->fiber_radius_m, half_height = 0.38 * pitch - o->fiber_radius_m,
           wave = 0.36 * pitch;
    size_t i_fiber = 0;
    for (int warp = 0; warp < 2; warp++)
        for (size_t y = 0; y < o->n_yarn; y++)
            for (size_t k = 0; k < o->n_strand; k++, i_fiber++) {
                f->axis_class[i_fiber] = (uint8_t)warp;
                double r = sqrt(((double)k + 0.5) / (double)o->n_strand), a0 = 2.399963 * (double)k + (double)y;
                for (size_t v = 0; v <= o->n_segment; v++) {
                    double t = (double)v / (double)o->n_segment, a = a0 + 2 * M_PI * o->twist_turns * t;
                    double along = t * o->tile_m;
                    double across = ((double)y + 0.5) * pitch + half_width * r * cos(a);
                    double phase = M_PI * (along / pitch - 0.5 + (double)y + (double)warp);
                    double z = wave * cos(phase) + half_height * r * sin(a);
                    float *p = f->position_m + 3 * (f->first_vertex[i_fiber] + v);
                    p[warp] = (float)along;
                    p[1 - warp] = (float)across;
                    p[2] = (float)z;
                }
            }
}

void hand_weave_bench(struct fiber_set *f)
{
    hand_weave(f, &(struct hand_weave_option){16, 32, 120, 4.45e-3, 16e-6, 4});
}

void hand_weave_small(struct fiber_set *f) { hand_weave(f, &(struct hand_weave_option){2, 12, 16, 0.55e-3, 16e-6, 1}); }

void hand_straight(struct fiber_set *f, size_t n, const double (*y_z_m)[2], double tile_m, double radius_m)
{
    start(f, n, 1, tile_m, radius_m);
    for (size_t i = 0; i < n; i++)
        for (int v = 0; v < 2; v++) {
            float *p = f->position_m + 3 * (2 * i + (size_t)v);
            p[0] = (float)(v * tile_m);
            p[1] = (float)y_z_m[i][0];
            p[2] = (float)y_z_m[i][1];
        }
}
