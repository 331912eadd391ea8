/* Paths of yarns: woven interlacings with crimp, and the jersey loop. */
#include "geometry/phantom/phantom_strand.h"

#include <math.h>
#include <stdlib.h>

enum { POINTS_PER_CROSSING = 32, POINTS_PER_LOOP = 160 };

/* Returns whether weft i lies above warp j. */
static bool weft_over(enum phantom_weave w, size_t i, size_t j)
{
    switch (w) {
    case PHANTOM_TWILL_2_2:
        return (j + 4 - i % 4) % 4 < 2;
    case PHANTOM_TWILL_3_1:
        return (j + 4 - i % 4) % 4 == 3;
    case PHANTOM_SATIN_5:
        return (j + 3 * i) % 5 == 0;
    default:
        return (i + j) % 2 == 0;
    }
}

static double whole_voxels(double length_m, double voxel_m) { return fmax(1.0, round(length_m / voxel_m)) * voxel_m; }

static status yarn_init(struct yarn *y, size_t n, struct error *err)
{
    y->n = n;
    y->point = calloc(n, sizeof *y->point);
    return y->point != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot make phantom: out of memory");
}

struct weave {
    const struct phantom_option *o;
    double spacing_m[2]; /* along x between warps, along y between wefts */
    double amplitude_m;  /* of the crimp */
    size_t n_yarn[2];    /* wefts, warps */
};

/* Makes yarn number i of class 0 (weft, along x) or 1 (warp, along y): level at each crossing, and half a cosine
 * between. */
static status add_woven_yarn(struct phantom_strands *s, const struct weave *w, int class, size_t i, struct error *err)
{
    size_t n_cross = w->n_yarn[1 - class];
    int along = class, across = 1 - class;
    struct yarn y = {.radius_m = w->o->fiber_radius_m[class],
                     .axis_class = (uint8_t) class,
                     .cut = class == 0 ? CUT_FACE_X : CUT_FACE_Y,
                     .number = (uint32_t)(2 * i + (size_t) class)};
    y.shift[along] = s->set.tile_m[along];
    status st = yarn_init(&y, n_cross * POINTS_PER_CROSSING, err);
    if (st != STATUS_OK) return st;
    for (size_t k = 0; k < y.n; k++) {
        double at = (double)k / POINTS_PER_CROSSING - 0.5; /* in spacings from the first crossing */
        size_t left = (size_t)(floor(at) + (double)n_cross) % n_cross, right = (left + 1) % n_cross;
        double level[2];
        for (int e = 0; e < 2; e++) {
            size_t j = e == 0 ? left : right;
            bool over = class == 0 ? weft_over(w->o->weave, i, j) : !weft_over(w->o->weave, j, i);
            level[e] = over ? w->amplitude_m : -w->amplitude_m;
        }
        double blend = 0.5 - 0.5 * cos(M_PI * (at - floor(at)));
        y.point[k][along] = (at + 0.5) * w->spacing_m[along];
        y.point[k][across] = ((double)i + 0.5) * w->spacing_m[across];
        y.point[k][2] = level[0] + blend * (level[1] - level[0]);
    }
    st = yarn_add(s, w->o, &y, err);
    free(y.point);
    return st;
}

status weave_make(struct phantom_strands *s, const struct phantom_option *o, struct phantom_report *r,
                  struct error *err)
{
    struct weave w = {.o = o, .n_yarn = {o->n_yarn[0], o->n_yarn[1]}};
    /* the pile of a velvet rises between ground yarns, which need gaps for it */
    double cover = o->weave == PHANTOM_VELVET ? 0.7 * o->cover : o->cover, height_m = 0.0;
    for (int class = 0; class < 2; class ++) {
        double section_m = yarn_section_radius_m(o, o->fiber_radius_m[class]);
        int across = 1 - class;
        s->set.tile_m[across] =
            whole_voxels((double)o->n_yarn[class] * 2.0 * section_m * sqrt(o->flatness) / cover, o->voxel_size_m);
        w.spacing_m[across] = s->set.tile_m[across] / (double)o->n_yarn[class];
        height_m += section_m / sqrt(o->flatness);
        if (class == 0) r->yarn_width_m = 2.0 * section_m * sqrt(o->flatness);
        if (class == 0) r->yarn_height_m = 2.0 * section_m / sqrt(o->flatness);
    }
    w.amplitude_m = 0.5 * height_m;
    r->yarn_spacing_m[0] = w.spacing_m[0];
    r->yarn_spacing_m[1] = w.spacing_m[1];
    for (int class = 0; class < 2; class ++)
        for (size_t i = 0; i < o->n_yarn[class]; i++) {
            status st = add_woven_yarn(s, &w, class, i, err);
            if (st != STATUS_OK) return st;
        }
    if (o->weave != PHANTOM_VELVET) return STATUS_OK;
    return pile_add(&s->set, o, 2.0 * w.amplitude_m, err);
}

/* Jersey: x = t + a sin 2t, y = h cos t, z = d cos 2t, in units of a wale's width / 2 pi. Heads and feet are on one
 * side, legs on the other. Courses are 5 units apart, so each head hangs over the legs of the next course. */
status knit_make(struct phantom_strands *s, const struct phantom_option *o, struct phantom_report *r, struct error *err)
{
    static const double a = 1.5, h = 4.0, d = 1.0, course = 5.0, yarn = 0.8;
    double section_m = yarn_section_radius_m(o, o->fiber_radius_m[0]), unit_m = section_m / (yarn * o->cover);
    s->set.tile_m[0] = whole_voxels((double)o->n_yarn[1] * 2.0 * M_PI * unit_m, o->voxel_size_m);
    s->set.tile_m[1] = whole_voxels((double)o->n_yarn[0] * course * unit_m, o->voxel_size_m);
    r->yarn_spacing_m[0] = s->set.tile_m[0] / (double)o->n_yarn[1];
    r->yarn_spacing_m[1] = s->set.tile_m[1] / (double)o->n_yarn[0];
    r->yarn_width_m = 2.0 * section_m * sqrt(o->flatness);
    r->yarn_height_m = 2.0 * section_m / sqrt(o->flatness);
    for (size_t i = 0; i < o->n_yarn[0]; i++) {
        struct yarn y = {.radius_m = o->fiber_radius_m[0], .axis_class = 0, .cut = CUT_PERIOD, .number = (uint32_t)i};
        y.shift[0] = s->set.tile_m[0];
        status st = yarn_init(&y, o->n_yarn[1] * POINTS_PER_LOOP, err);
        if (st != STATUS_OK) return st;
        for (size_t k = 0; k < y.n; k++) {
            double t = 2.0 * M_PI * (double)k / POINTS_PER_LOOP;
            y.point[k][0] = (t + a * sin(2.0 * t)) / (2.0 * M_PI) * r->yarn_spacing_m[0];
            y.point[k][1] = ((double)i + 0.5 + h / course * cos(t)) * r->yarn_spacing_m[1];
            y.point[k][2] = d * unit_m * cos(2.0 * t);
        }
        st = yarn_add(s, o, &y, err);
        free(y.point);
        if (st != STATUS_OK) return st;
    }
    return STATUS_OK;
}
