/* Phantoms: cloth whose fibers are known exactly, and the volume that a CT scanner would make of it.
 *
 * The fibers form one tile that repeats in x and y without a seam: a fiber that leaves through a face continues as
 * the same or another fiber at the opposite face. Weaves and knits are made of yarns. The fibers of a yarn lie on a
 * hexagonal lattice in a flattened section, which turns about the path of the yarn by a whole number of sixths of a
 * turn per tile; the lattice then maps to itself, so the tile closes. All fibers are then pushed apart until they
 * hardly interpenetrate, without being bent more than fibers can bear. The yarn model follows Zhao et al. 2016,
 * "Fitting procedural yarn models for realistic cloth rendering" (section 3: packing, twist, migration, fly-aways),
 * without plies. With the parameters of a real yarn (phantom_yarn_read) yarns are plied by the laws of the paper
 * instead. The loop of the knit follows Peirce's jersey. The result depends only on the options and the seed, not on
 * the number of threads. */
#ifndef SELVEDGE_GEOMETRY_PHANTOM_H
#define SELVEDGE_GEOMETRY_PHANTOM_H

#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/phantom/phantom_option.h"
#include "geometry/phantom/phantom_section.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

/* Parses "plain", "twill" (2/2), "twill31", "satin", "velvet", "knit" or "felt". */
const char *phantom_weave_name(enum phantom_weave w);
/* STATUS_INVALID lists the names. */
status phantom_weave_find(const char *name, enum phantom_weave *w, struct error *err);

/* Reads a parameter file as published for the CT fits of Zhao et al. 2016 ("key: value", centimetres). STATUS_FORMAT
 * names the line. */
status phantom_yarn_read(const char *path, struct phantom_yarn_law *yarn, struct error *err);

/* Sets a fiber diameter of 7 voxels of 2 um, 19 fibers per yarn (velvet 7, felt 60 in total), and yarns flattened by
 * 1.8 (knit 1, round). */
void phantom_option_default(struct phantom_option *o, enum phantom_weave weave);

/* f must be initialised; its content is replaced. The lowest surface is at z = margin_m, and the corner of the
 * volume is the origin. pool may be NULL. STATUS_INVALID, with err->field naming the option, STATUS_NO_MEMORY,
 * STATUS_CANCELLED. */
status phantom_generate(const struct phantom_option *o, struct thread_pool *pool, const struct progress *progress,
                        struct fiber_set *f, struct phantom_report *report, struct error *err);

/* Adds the same void below and above the cloth, up to n_slice slices in total: raises f and changes
 * report->n_voxel[2]. STATUS_INVALID, field "voxels_z", if the cloth needs more. */
status phantom_pad(struct fiber_set *f, struct phantom_report *report, double voxel_size_m, size_t n_slice,
                   struct error *err);

/* Options of the simulated scanner. Signal: void 0, fiber 1. */
struct phantom_scan_option {
    uint64_t seed;
    double voxel_size_m;
    double blur_sd_voxel;  /* Gaussian point spread */
    double snr;            /* (fiber - void) / standard deviation of the Gaussian noise; 0: no noise */
    double poisson_count;  /* counts at signal 1, a tenth of them in void; 0: no Poisson noise */
    double ring_amplitude; /* standard deviation of concentric rings about an axis along z */
    double gradient;       /* relative change of the signal from x = 0 to the opposite face */
    double noise_sd_voxel; /* of the Gaussian that correlates the Gaussian noise, whose strength stays; 0: white */
    double beam_hardening; /* share of the signal that is lost amid material; 0: none */
    double phase_fringes;  /* strength of the fringes at outlines; 0: none (phantom_raster.c) */
    struct phantom_section_law section; /* that with which the fibers were made */
    bool own_sections; /* draws the sections that the fibers state (fiber_shape.h), not sections of the law */
};

void phantom_scan_option_default(struct phantom_scan_option *o);

/* Makes v, which the caller releases, from signal values that are not clamped. n: number of voxels; periodic in x
 * and y if n * voxel = tile. A voxel's value before blur is the share of it inside fibers, by a ramp that preserves
 * area and second moment (phantom_raster.c). STATUS_INVALID, STATUS_NO_MEMORY, STATUS_CANCELLED. */
status phantom_scan(const struct fiber_set *f, const size_t n[3], const struct phantom_scan_option *o,
                    struct thread_pool *pool, const struct progress *progress, struct volume *v, struct error *err);
/* The same with the volume in a scratch space, whose limit also holds for the computation (NULL: memory). */
status phantom_scan_in(const struct fiber_set *f, const size_t n[3], const struct phantom_scan_option *o,
                       struct scratch_space *space, struct thread_pool *pool, const struct progress *progress,
                       struct volume *v, struct error *err);

/* The stored value is void_value + signal * (fiber_value - void_value), rounded and clamped to the type. */
struct phantom_file_option {
    int bits; /* 8 or 16 */
    double void_value, fiber_value;
    bool deflate;
};

/* 16 bit, void 10000, fiber 40000, deflate. */
void phantom_file_option_default(struct phantom_file_option *o);
/* Writes a multi-page TIFF whose page k is slice k in z; BigTIFF if it is needed. */
status phantom_write_tiff(const struct volume *v, const struct phantom_file_option *o, const char *path,
                          struct error *err);
/* Writes MetaImage: path ends in ".mhd", and the data goes to a file ".raw" beside it. Spacing is in millimetres. */
status phantom_write_metaimage(const struct volume *v, const struct phantom_file_option *o, const char *path,
                               struct error *err);
/* Writes a CSV table with radius and section of each fiber, one line a fiber. Angles as in phantom_section.h. */
status phantom_write_sections(const struct fiber_set *f, const struct phantom_section_law *law, const char *path,
                              struct error *err);

#endif
