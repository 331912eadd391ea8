/* A cloth described by its weave and by the numbers of its yarns, instead of a scan or a file of fibers.
 *
 * A description is pure data: the structure, up to four kinds of yarn, their order in warp and weft, and a list of
 * numbers. The numbers that a cloth has follow from its structure and its yarns; they are rows of
 * base/catalogue/cloth_numbers.def, in whose order the flat vector of their values stands. Values are in the units of
 * files. geometry/cloth makes fibers of a description.
 *
 * To fill one: cloth_description_init, then the members that differ (draft, kinds, orders), then
 * cloth_description_number, which lists the numbers with their defaults, then values, bounds and priors, and last
 * cloth_description_check. */
#ifndef SELVEDGE_BASE_CLOTH_DESCRIPTION_H
#define SELVEDGE_BASE_CLOTH_DESCRIPTION_H

#include "base/catalogue/film_material.h"
#include "base/catalogue/model_sets.h"
#include "base/catalogue/param_info.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    CLOTH_MAX_KIND = 4,    /* kinds of yarn */
    CLOTH_MAX_GROUP = 8,   /* groups of fibers and of films */
    CLOTH_MAX_DRAFT = 32,  /* rows and columns of a draft */
    CLOTH_MAX_ORDER = 64,  /* yarns of one direction after which the order of the kinds repeats */
    CLOTH_MAX_YARN = 128,  /* yarns of one direction in a tile */
    CLOTH_MAX_NUMBER = 96, /* numbers of a cloth */
    CLOTH_MAX_FIBER = 1000,
    CLOTH_MAX_FELT_FIBER = 100000, /* fibers in the tile of a felt */
    CLOTH_MAX_PLY = 8
};

enum cloth_structure { CLOTH_WOVEN, CLOTH_KNIT, CLOTH_VELVET, CLOTH_FELT, CLOTH_N_STRUCTURE };
enum cloth_direction { CLOTH_WEFT, CLOTH_WARP }; /* weft runs along x, warp along y */

/* Which cloths have a number. */
enum cloth_has {
    CLOTH_HAS_WEAVE = 1,       /* woven cloths and the ground of a velvet */
    CLOTH_HAS_LOOPS = 2,       /* knits */
    CLOTH_HAS_PILE = 4,        /* velvets */
    CLOTH_HAS_FELT = 8,        /* felts */
    CLOTH_HAS_PLIES = 16,      /* yarns of at least two plies */
    CLOTH_HAS_MELANGE = 32,    /* yarns with mixed fibers */
    CLOTH_HAS_WARP_COVER = 64, /* weaves and velvets whose warps per cm are not given */
    CLOTH_HAS_WEFT_COVER = 128 /* weaves and velvets whose wefts per cm are not given */
};
#define CLOTH_HAS_YARN (CLOTH_HAS_WEAVE | CLOTH_HAS_LOOPS)
#define CLOTH_HAS_ANY (CLOTH_HAS_YARN | CLOTH_HAS_PILE | CLOTH_HAS_FELT)

/* One row of the catalogue. */
struct cloth_number_info {
    const char *name, *unit;
    bool of_yarn; /* one value for each kind of yarn; else one for the cloth */
    double lower, upper, standard;
    enum param_coordinate coordinate; /* PARAM_LINEAR or PARAM_LOG */
    unsigned structures;              /* of enum cloth_has */
    const char *meaning;
};

/* One number of one cloth. It has the same index in cloth_description.number as its value in the flat vector. */
struct cloth_number {
    const struct cloth_number_info *info;
    int kind;                    /* kind of yarn; -1: of the cloth */
    char name[48];               /* "crimp", "yarns[0].flatness" */
    double value;                /* given, or the start of the search */
    bool fitted;                 /* to be searched within lower .. upper */
    double lower, upper;         /* of the search, inside the range of the catalogue */
    double prior_mean, prior_sd; /* on the number itself; NaN: no prior */
};

/* STATUS_INVALID, with err->field naming the number: a value, bounds or a prior that cannot be. */
status cloth_number_check_one(const struct cloth_number *n, struct error *err);

/* A film of metallised plastic around the fibers of a yarn, or in place of them. */
struct cloth_film {
    double width_um;     /* 0: the yarn has no film, and the other members count for nothing */
    double thickness_um; /* of the film, at its middle: the section is an ellipse */
    double wraps_per_m;  /* turns about the yarn in a metre of it; negative turns the other way */
    struct film_material material;
};

/* Discs of film on the face of a cloth. */
struct cloth_sequins {
    double diameter_um; /* 0: the cloth has none */
    double thickness_um;
    double spacing_um, row_spacing_um; /* between middles along x, and between rows; a whole number fits in the tile */
    double tilt_deg, tilt_spread_deg;  /* of all discs alike, and standard deviation of each disc */
    struct film_material material;
};

/* Counts and names of one kind of yarn. */
struct cloth_kind {
    size_t n_fiber;   /* fibers in a section; of a tuft of the pile; of a felt: in the tile; 0: the yarn is its film */
    size_t n_ply;     /* 1: single yarn */
    int melange_with; /* kind that the share `melange` of its fibers belongs to; -1: none */
    char name[MODEL_SET_NAME_BYTES]; /* of its group of fibers; "": none */
    struct cloth_film film;
};

struct cloth_description {
    char weave[16]; /* name, or "" where a draft is given */
    enum cloth_structure structure;
    size_t n_weft, n_warp;                            /* size of the draft: one repeat */
    bool warp_over[CLOTH_MAX_DRAFT][CLOTH_MAX_DRAFT]; /* [weft][warp], row 0 at the lower edge (y = 0) */
    size_t n_kind;
    struct cloth_kind kind[CLOTH_MAX_KIND];
    size_t n_order[2];                 /* of enum cloth_direction; the order repeats after as many yarns */
    uint8_t order[2][CLOTH_MAX_ORDER]; /* kinds of the yarns; a knit takes its courses from [CLOTH_WEFT] */
    int pile_kind;                     /* kind of the pile's fibers in a velvet, else -1 */
    size_t n_yarn[2];                  /* yarns in the tile; 0: chosen by cloth_description_check */
    struct cloth_sequins sequins;
    double threads_per_cm[2]; /* wefts, warps; 0: follows from cover, else it replaces cover */
    uint64_t seed;
    size_t n_number;
    struct cloth_number number[CLOTH_MAX_NUMBER];
};

/* Names that the builder of a cloth puts into err->field: of a number, and of the counted threads. */
#define CLOTH_FIELD_CRIMP "crimp"
#define CLOTH_FIELD_WARP_PER_CM "warp_per_cm"
#define CLOTH_FIELD_WEFT_PER_CM "weft_per_cm"

/* The rows of the catalogue, ended by a row without a name. */
extern const struct cloth_number_info cloth_number_table[];

/* Names of weaves in order, ended by NULL. */
extern const char *const cloth_weave_names[];

/* Sets a described cloth of one kind of yarn with the named weave, its default numbers, seed 1 and the order 0 in warp
 * and weft. A velvet has a second kind, its pile. STATUS_INVALID, field "weave", lists the names. */
status cloth_description_init(struct cloth_description *d, const char *weave, struct error *err);

/* Replaces the weave by a draft: n_row texts of equal length of '1' (warp over weft) and '0', the upper edge first.
 * STATUS_INVALID, field "draft". */
status cloth_description_draft(struct cloth_description *d, const char *const *row, size_t n_row, struct error *err);

/* Lists the numbers that the cloth has, with the values of the catalogue and nothing fitted. Numbers of the same name
 * that were listed before keep their values. */
void cloth_description_number(struct cloth_description *d);

/* Index of a number by name, or -1. */
int cloth_number_index(const struct cloth_description *d, const char *name);

/* Value of the number `name` of kind (-1: of the cloth) in the flat vector; NaN if the cloth has none. */
double cloth_number_value(const struct cloth_description *d, const double *number, int kind, const char *name);

/* Kinds that have fibers; kinds that are films alone follow them. */
size_t cloth_n_fiber_kind(const struct cloth_description *d);
/* Group of fibers of the film of a kind that has one; kind n_kind: of the sequins. */
size_t cloth_film_group(const struct cloth_description *d, size_t kind);
/* The materials of all films by their groups. */
void cloth_film_groups(const struct cloth_description *d, struct film_groups *g);

/* Completes d (n_yarn) and checks it. STATUS_INVALID with the field as in the job document after "cloth.": "draft" (a
 * yarn that never crosses, or yarns that lie above all others), "warp", "weft" (orders that name no kind, or do not
 * repeat within CLOTH_MAX_YARN yarns), "tile_warps", "tile_wefts" (no multiple of the repeat), "yarns" (several kinds
 * in a felt), "yarns[k]" (a kind that no yarn has), "yarns[k].plies", "yarns[k].film_width_um", "sequin_spacing_um",
 * "crimp" and so on for values outside of their ranges and for fitted numbers that change nothing. */
status cloth_description_check(struct cloth_description *d, struct error *err);

/* Sets `to` to the cloth d, which has passed cloth_description_check, with a tile that is `times` as long along both
 * edges: so many times the yarns of both directions, or times^2 the fibers of a felt. STATUS_INVALID, field
 * "final_tiles", where that is more than a cloth can have. */
status cloth_description_enlarge(const struct cloth_description *d, size_t times, struct cloth_description *to,
                                 struct error *err);

/* Checks a vector of d->n_number values against the ranges of the catalogue. STATUS_INVALID, field: the number. */
status cloth_number_check(const struct cloth_description *d, const double *number, struct error *err);

#endif
