/* Phantoms: cloth whose fibers are known exactly, and the CT-like volume that a scanner would make of it.
 *
 * Fibers form one tile that repeats in x and y without a seam: a fiber that leaves through a face goes on as a fiber (the same or
 * another) at the opposite face. Weaves and knits are made of yarns: fibers on a hexagonal lattice in a flattened section, turned about
 * the yarn's path by a whole number of sixths of a turn per tile (the lattice maps to itself, so the tile closes). All fibers are then
 * pushed apart until they hardly interpenetrate, without bending them more than fibers bear. Yarn model after Zhao et al. 2016, "Fitting procedural yarn models for realistic cloth
 * rendering" (section 3: packing, twist, migration, fly-aways), without plies; with the parameters of a real yarn (phantom_yarn_read)
 * the yarns are plied by the laws of that paper instead; the loop of the knit after Peirce's jersey.
 * Everything follows from the options and the seed: the same numbers for any number of threads.
 */
#ifndef SELVEDGE_GEOMETRY_PHANTOM_H
#define SELVEDGE_GEOMETRY_PHANTOM_H

#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

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

/* "plain", "twill" (2/2), "twill31", "satin", "velvet", "knit", "felt". */
const char *phantom_weave_name(enum phantom_weave w);
/* STATUS_INVALID listing the names. */
status phantom_weave_find(const char *name, enum phantom_weave *w, struct error *err);

/* A real yarn: plies about the yarn's centre, fibers about their ply. Lengths are the yarn's own; pairs are mean and standard deviation.
 * Pitches are lengths of one turn, negative clockwise. */
struct phantom_yarn_law {
    size_t n_ply, n_fiber; /* n_ply 0: no such yarn; fibers a ply */
    double ply_pitch_m, fiber_pitch_m;
    double ply_distance_m;       /* of the plies' centres from the yarn's */
    double ellipse_m[2];         /* half axes of a ply's section: around the yarn, and towards its centre */
    double epsilon, beta, r_max; /* radial density of fibers */
    double migration_waves, rho_min, rho_max; /* waves a turn of the fiber */
    double hair_per_m, hair_length_m[2], hair_start_m[2], hair_reach_m[2], hair_turn_rad[2]; /* a ply */
    double loop_per_m, loop_radius_m[2];
};

/* A parameter file as published for the CT fits of Zhao et al. 2016 ("key: value", centimetres). STATUS_FORMAT names the line. */
status phantom_yarn_read(const char *path, struct phantom_yarn_law *yarn, struct error *err);

struct phantom_option {
    enum phantom_weave weave;
    uint64_t seed;
    double voxel_size_m;
    double fiber_radius_m[3]; /* of weft, warp, pile fibers; felt uses the first, knit the first */
    size_t
        n_yarn[2]; /* per tile: weft yarns (rows), warp yarns (columns); knit: courses, wales; multiples of the weave's
                                  repeat (plain, velvet 2; twill 4; satin 5; knit 1); 0: one repeat */
    size_t n_fiber_per_yarn; /* rounded up to 1 + 6 k; felt: fibers in all */
    double packing;          /* share of the yarn's section that is fiber, 0.3 .. 0.9 */
    double flatness;         /* width over height of a yarn's section, 1 .. 4 */
    double cover;            /* yarn width over yarn spacing, 0.5 .. 1.3 */
    double twist_turns;      /* turns a tile; rounded to sixths; negative turns the other way */
    double migration;        /* relative amplitude of the radial wandering of fibers, 0 .. 0.5 */
    size_t n_flyaway_per_yarn;
    struct phantom_yarn_law yarn; /* n_ply > 0: it replaces fibers a yarn, twist, migration and fly-aways */
    bool
        yarn_true_size; /* keep the yarn's lengths; else it is scaled as a whole so that `packing` of a ply's section is fiber */
    double pile_height_m; /* velvet: above the ground */
    double felt_tile_m;   /* felt: edge of the tile */
    double felt_thickness_m;
    size_t n_relax;          /* rounds of pushing apart */
    double vertex_spacing_m; /* 0: 1.5 voxels */
    double margin_m;         /* empty space below and above; 0: 4 voxels */
};

/* Fiber diameter 7 voxels of 2 um; 19 fibers a yarn (velvet 7, felt 60 in all); yarns flattened by 1.8 (knit 1, round). */
void phantom_option_default(struct phantom_option *o, enum phantom_weave weave);

struct phantom_report {
    size_t n_voxel[3]; /* grid that holds one tile */
    double yarn_spacing_m[2], yarn_width_m,
        yarn_height_m; /* zero without yarns; yarns as designed, before pushing apart */
    size_t n_fiber_per_yarn;
    double twist_turns;    /* after rounding; plied: of the weft's plies */
    struct phantom_plied { /* of a real yarn; 0 weft, 1 warp */
        double scale, ply_turns[2], wanted_ply_turns[2],
            fiber_turns[2]; /* turns a tile, rounded so that it closes, and before */
        size_t n_hair, n_loop;
    } plied;
    double overlap_mean,
        overlap_max; /* depth of interpenetration over the diameter: mean over all fiber points, and the largest */
    double
        strain_p95; /* of the fibers' surface where they bend (radius / radius of curvature): 95 % of the points stay below */
    double cover;           /* share of the tile's area under at least one fiber, looking along z */
    double volume_fraction; /* fiber volume over tile area x thickness */
};

/* f must be initialised; its content is replaced. z_min of the surfaces is margin_m, the volume's corner is the origin.
 * STATUS_INVALID with err->field naming the option. pool may be NULL. */
status phantom_generate(const struct phantom_option *o, struct thread_pool *pool, const struct progress *progress,
                        struct fiber_set *f, struct phantom_report *report, struct error *err);

/* Void below and above the cloth, as much on either side, up to n_slice slices in all: f is raised, report->n_voxel[2] changed.
 * STATUS_INVALID, field "voxels_z", when the cloth needs more. */
status phantom_pad(struct fiber_set *f, struct phantom_report *report, double voxel_size_m, size_t n_slice,
                   struct error *err);

/* How the scanner sees it. Signal: void 0, fiber 1. */
struct phantom_scan_option {
    uint64_t seed;
    double voxel_size_m;
    double blur_sd_voxel;  /* Gaussian point spread */
    double snr;            /* (fiber - void) / sd of the Gaussian noise; 0: no noise */
    double poisson_count;  /* counts at signal 1; 0: no Poisson noise. Void has a tenth of them */
    double ring_amplitude; /* sd of concentric rings about an axis along z */
    double gradient;       /* relative change of the signal's strength from x = 0 to the opposite face */
};

void phantom_scan_option_default(struct phantom_scan_option *o);

/* v (uninitialised; volume_release it) gets signal units, not clamped. n: voxels; periodic in x and y when n * voxel = tile.
 * A voxel's value before blur is the share of it inside fibers, by the ramp that keeps area and second moment (phantom_raster.c). */
status phantom_scan(const struct fiber_set *f, const size_t n[3], const struct phantom_scan_option *o,
                    struct thread_pool *pool, const struct progress *progress, struct volume *v, struct error *err);
/* The same with the volume in a scratch space, whose limit holds for the work on it, too (NULL: memory). */
status phantom_scan_in(const struct fiber_set *f, const size_t n[3], const struct phantom_scan_option *o,
                       struct scratch_space *space, struct thread_pool *pool, const struct progress *progress,
                       struct volume *v, struct error *err);

/* Share of the tile's area under a fiber, looking along z, at the given pixel size; grey (optional) gets one byte a pixel,
 * 255 for the highest fiber (malloc'ed, nx x ny, row 0 at y = 0). */
status phantom_top_view(const struct fiber_set *f, double pixel_size_m, size_t size[2], uint8_t **grey, double *cover,
                        struct error *err);

/* Signal -> void_value + signal * (fiber_value - void_value), rounded and clamped to the type. */
struct phantom_file_option {
    int bits; /* 8 or 16 */
    double void_value, fiber_value;
    bool deflate;
};

/* 16 bit, void 10000, fiber 40000, deflate. */
void phantom_file_option_default(struct phantom_file_option *o);
/* Multi-page TIFF, page k is slice k in z; BigTIFF where needed. */
status phantom_write_tiff(const struct volume *v, const struct phantom_file_option *o, const char *path,
                          struct error *err);
/* MetaImage: path ends in ".mhd", the data go to the same name with ".raw" beside it. Spacing in millimetres. */
status phantom_write_metaimage(const struct volume *v, const struct phantom_file_option *o, const char *path,
                               struct error *err);

#endif
