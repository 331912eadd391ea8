/* The sections "sample", "fibers", "cloth" and "correction" of a job document: the name of the cloth, a cloth that is
 * given as fibers or described, the groups of its fibers, and corrections of them. */
#ifndef SELVEDGE_OPTIMIZER_JOB_CLOTH_H
#define SELVEDGE_OPTIMIZER_JOB_CLOTH_H

#include "base/catalogue/correction_numbers.h"
#include "base/catalogue/film_material.h"
#include "base/catalogue/model_sets.h"
#include "base/status.h"
#include "optimizer/job/document/job_limits.h"

#include <stdbool.h>
#include <stdint.h>

/* A film of a yarn, or sequins, as given; NaN and "": not given. */
struct job_film {
    double width_um, thickness_um, wraps_per_m, roughness, grain_um, color[3];
    double spacing_um, row_spacing_um, tilt_deg, tilt_spread_deg; /* of sequins */
    char metal[16], surface[16], optics[16];
};

/* Counts and names that the document gives of a kind of yarn; 0 fibers: not given. */
struct job_cloth_yarn {
    size_t n_fiber, n_ply, melange_with;
    char name[MODEL_SET_NAME_BYTES]; /* "": none */
    struct job_film film;
};

struct job_cloth {
    char sample[JOB_MAX_SAMPLE_BYTES];    /* name of the cloth for people */
    char composition[JOB_MAX_NAME_BYTES]; /* fiber_composition.h; "": not given */
    double weight_g_m2;                   /* NaN: not given */
    char fiber_file[JOB_MAX_NAME_BYTES];
    double fiber_radius_um; /* of fiber files that state none; NaN: not given */
    double tile_mm[2];      /* NaN: from the file */
    double voxel_um;        /* NaN: chosen from the radius */
    /* The section "cloth" as given; `description` is the checked description, NULL without the section. */
    char weave[16];
    char draft_file[JOB_MAX_NAME_BYTES]; /* "" when none is given */
    char texture[JOB_MAX_NAME_BYTES];    /* photograph that shows the weave; "" when none is given */
    double texture_px_per_mm;            /* NaN: not given */
    bool texture_colors;                 /* start C_TT of the kinds at the colors of the photograph */
    bool draft_from_texture;             /* neither weave nor draft is given */
    size_t tile_yarn[2];                 /* of enum cloth_direction; 0: not given */
    size_t final_tiles;                  /* times that the tile of the final fit is as long along both edges */
    bool renew_places;                   /* other random places in each estimate of the joint fit */
    double threads_per_cm[2];            /* NaN: not given */
    uint64_t seed;
    size_t n_yarn;
    struct job_cloth_yarn *yarn;
    struct job_film sequins;
    struct cloth_description *description;
    bool has_correction;
    struct cloth_number correction[CORRECTION_N]; /* of scanned or given fibers; set with has_correction */
    /* The groups of fibers that have scattering parameters of their own; 0: one set of parameters for all fibers. */
    size_t n_group;
    char group[MODEL_MAX_SET][MODEL_SET_NAME_BYTES];
};

/* The films of a described cloth, for its scene; none of other cloths. */
void job_cloth_films(const struct job_cloth *cloth, struct film_groups *films);

/* Puts the section "cloth" before the field that a check or the builder of a described cloth named, in the error's text
 * too. */
void job_cloth_name_field(struct error *err);

/* STATUS_INVALID, field "final_tiles" or "renew_places", where the described cloth has no fitted numbers, or its tile
 * cannot be made as large as the document asks for. */
status job_cloth_check_final_tiles(const struct job_cloth *cloth, struct error *err);

#endif
