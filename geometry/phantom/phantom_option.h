/* The options of a phantom (phantom.h), and the report of its generation. */
#ifndef SELVEDGE_GEOMETRY_PHANTOM_OPTION_H
#define SELVEDGE_GEOMETRY_PHANTOM_OPTION_H

#include "geometry/phantom/phantom_section.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum phantom_weave {
    PHANTOM_PLAIN,
    PHANTOM_TWILL_2_2,
    PHANTOM_TWILL_3_1,
    PHANTOM_SATIN_5,
    PHANTOM_VELVET, /* plain ground with a leaning pile */
    PHANTOM_KNIT,   /* plain jersey */
    PHANTOM_FELT,   /* fibers in all directions of the plane, no yarns */
    PHANTOM_WEAVE_COUNT
};

/* A real yarn: plies around the centre of the yarn, and fibers around their ply. Lengths belong to the yarn;
 * pairs are mean and standard deviation. Pitches are lengths of one turn, negative if clockwise. */
struct phantom_yarn_law {
    size_t n_ply, n_fiber; /* fibers per ply; n_ply 0: no such yarn */
    double ply_pitch_m, fiber_pitch_m;
    double ply_distance_m;       /* distance of the plies' centres from the yarn's centre */
    double ellipse_m[2];         /* half axes of a ply's section: around the yarn, and towards its centre */
    double epsilon, beta, r_max; /* radial density of fibers */
    double migration_waves, rho_min, rho_max; /* waves per turn of the fiber */
    double hair_per_m, hair_length_m[2], hair_start_m[2], hair_reach_m[2], hair_turn_rad[2]; /* per ply */
    double loop_per_m, loop_radius_m[2];
};

struct phantom_option {
    enum phantom_weave weave;
    uint64_t seed;
    double voxel_size_m;
    double fiber_radius_m[3]; /* of weft, warp, pile fibers; felt uses the first, knit the first */
    /* Standard deviation of the radii over their mean, 0 .. 0.3: each strand has its own, normal and cut at twice that.
     * Pieces of a fiber at the faces of the tile have the same. */
    double radius_spread;
    struct phantom_section_law section; /* makes room for flat sections; the scan draws them */
    /* Yarns per tile: wefts (rows) and warps (columns), or for a knit courses and wales. Multiples of the repeat of
     * the weave: plain and velvet 2, twill 4, satin 5, knit 1. 0: one repeat. */
    size_t n_yarn[2];
    size_t n_fiber_per_yarn; /* rounded up to 1 + 6 k; felt: total number of fibers */
    double packing;          /* share of the yarn's section that is fiber, 0.3 .. 0.9 */
    double flatness;         /* width over height of a yarn's section, 1 .. 4 */
    double cover;            /* yarn width over yarn spacing, 0.5 .. 1.3 */
    double twist_turns;      /* turns per tile, rounded to sixths; negative turns the other way */
    double migration;        /* relative amplitude of the radial wandering of fibers, 0 .. 0.5 */
    size_t n_flyaway_per_yarn;
    struct phantom_yarn_law yarn; /* n_ply > 0: it replaces fibers per yarn, twist, migration and fly-aways */
    /* Keep the lengths of the yarn; else it is scaled so that `packing` of a ply's section is fiber. */
    bool yarn_true_size;
    double pile_height_m; /* velvet: above the ground */
    double felt_tile_m;   /* felt: edge of the tile */
    double felt_thickness_m;
    size_t n_relax;          /* number of rounds of pushing apart */
    double vertex_spacing_m; /* 0: 1.5 voxels */
    double margin_m;         /* empty space below and above; 0: 4 voxels */
};

struct phantom_report {
    size_t n_voxel[3];                                     /* grid that holds one tile */
    double yarn_spacing_m[2], yarn_width_m, yarn_height_m; /* as designed, before pushing apart; 0 without yarns */
    size_t n_fiber_per_yarn;
    double twist_turns;    /* after rounding; plied: of the plies of the weft */
    struct phantom_plied { /* of a real yarn; [0] weft, [1] warp */
        /* Turns per tile: rounded so that the tile closes, and as wanted before. */
        double scale, ply_turns[2], wanted_ply_turns[2], fiber_turns[2];
        size_t n_hair, n_loop;
    } plied;
    /* Depth of interpenetration over the diameter: mean over all points of fibers, and the largest. */
    double overlap_mean, overlap_max;
    double strain_p95; /* of the surface of bent fibers (radius / radius of curvature): 95 % of the points stay below */
    double cover;      /* share of the area of the tile under at least one fiber, along z */
    double volume_fraction; /* volume of the fibers over tile area x thickness */
};

#endif
