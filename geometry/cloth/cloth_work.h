/* The parts of a described cloth while it is made (used only in this folder). Lengths are in metres. */
#ifndef SELVEDGE_GEOMETRY_CLOTH_WORK_H
#define SELVEDGE_GEOMETRY_CLOTH_WORK_H

#include "geometry/cloth/cloth.h"
#include "geometry/cloth/yarn_path.h"

enum { POINTS_PER_CROSSING = 24, N_WAVE = 4, MAX_CLOTH_NODES = 20000000 };

/* One kind of yarn at the present numbers. */
struct kind_shape {
    size_t n_fiber, n_ply;
    int melange_with;
    double radius_m, radius_spread, fiber_flatness, packing, flatness, twist_per_m, ply_twist_per_m, migration,
        fiber_angle_rad;
    double hairs_per_m, hair_length_m, melange;
    double round_m;        /* radius of the yarn's round section */
    double outer_m;        /* the same with the film around the yarn; half the width of a film alone */
    double half_m[2];      /* of the flattened section: width, height */
    double ply_radius_m;   /* of the section of a ply; round_m of a single yarn */
    double ply_distance_m; /* between the centres of ply and yarn; 0 of a single yarn */
    double core_half_m[2]; /* half_m without the film around the yarn */
    double turn_of_twist;  /* turns of the flattened section for each turn of the round one */
};

/* Films while they are made (cloth_film.h). */
struct film_node;
struct film_nodes {
    size_t n, capacity;
    struct film_node *node;
};

struct cloth_work {
    const struct cloth_description *d;
    const double *number; /* flat vector, never NULL */
    struct kind_shape kind[CLOTH_MAX_KIND];
    /* Sizes at the description's own values: they decide counts of nodes, which thus do not depend on the vector. */
    struct kind_shape nominal[CLOTH_MAX_KIND];
    double nominal_tile_m[2];
    double spacing_m[2]; /* mean, along x (warps) and y (wefts) */
    struct strand_set set;
    struct film_nodes film;
};

/* Value of a number of the cloth; NaN if it has none. */
double work_number(const struct cloth_work *w, const char *name);
/* STATUS_TOO_LARGE when the nodes so far and n_more further ones are more than a job can trace. */
status work_has_room(const struct cloth_work *w, size_t n_more, struct error *err);
/* Fills w->kind and w->nominal. */
void kind_shapes(struct cloth_work *w);

/* A periodic random function of s with period 1, mean 0 and standard deviation 1: a few smooth waves. */
struct wave {
    double a[N_WAVE], b[N_WAVE];
    double k[N_WAVE]; /* waves per period */
};
struct rng;
/* n_least: waves per period of the longest; they follow each other. */
void wave_draw(struct wave *v, double n_least, struct rng *rng);
/* Waves of a band that does not depend on the period: the longest have n_longest periods in it, which need not be
 * whole, and the others follow in steps of step. Each number of waves is drawn at random within its step, is whole
 * and at least 1. So a longer period has more waves of the same lengths, and no pattern repeats in it. */
void wave_draw_band(struct wave *v, double n_longest, double step, struct rng *rng);
double wave_at(const struct wave *v, double s);
/* Standard deviation of the slope by s. */
double wave_slope_sd(const struct wave *v);

/* Nodes of the staple fibers of one yarn of a kind, of the length nominal_m at the description's own values. */
size_t yarn_nodes(const struct cloth_work *w, size_t kind, double nominal_m);
/* Adds the staple fibers and hairs of one yarn. nominal_m: its length at the description's own values. yarn_number
 * selects random streams. */
status yarn_fill(struct cloth_work *w, size_t kind, const struct yarn *path, double nominal_m, struct error *err);

/* Set tile_m and add all fibers. */
status cloth_weave(struct cloth_work *w, struct error *err);
status cloth_knit(struct cloth_work *w, struct error *err);
status cloth_felt(struct cloth_work *w, struct error *err);
/* Adds the pile of a velvet above the ground. x_m, y_m: borders between warps and between wefts. */
status cloth_pile(struct cloth_work *w, const double *x_m, const double *y_m, double ground_m, struct error *err);

#endif
