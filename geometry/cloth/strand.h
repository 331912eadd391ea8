/* Strands: the working form of fibers while a cloth is made.
 *
 * A strand is a chain of nodes about one radius apart. A closed strand runs through n_period tiles before it meets
 * itself again: its node n is node 0 moved by `shift`. An open strand ends at its last node. Lengths are in metres,
 * before the tile is moved to its place in z. */
#ifndef SELVEDGE_GEOMETRY_STRAND_H
#define SELVEDGE_GEOMETRY_STRAND_H

#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"

/* Where a strand is cut into fibers. CUT_PERIOD is for closed strands. */
enum strand_cut { CUT_NONE, CUT_FACE_X = 1, CUT_FACE_Y = 2, CUT_FACE_XY = 3, CUT_PERIOD = 4 };

struct strand {
    size_t first, n; /* nodes */
    double shift[2]; /* of a closed strand; 0, 0 if open */
    size_t n_period; /* 0: open */
    double radius_m;
    double ratio; /* long over short axis of the section; up to 1: round */
    uint8_t axis_class;
    uint8_t group; /* of its fibers (fiber_set.h) */
    bool hair;     /* protrudes from a yarn */
    bool fixed;    /* pushes others and stays where it is; only while strands are pushed apart */
    /* Length of an open strand, as a share, that belongs to group_of_start instead; a fiber begins there. */
    double start_share;
    uint8_t group_of_start;
    enum strand_cut cut;
};

struct strand_set {
    double tile_m[2];
    size_t n_strand, strand_capacity;
    struct strand *strand;
    size_t n_node, node_capacity;
    double (*start)[3]; /* where the design put the node */
    double (*p)[3];     /* where it is now */
    bool flat;          /* whether sections may be flat; set before the first strand */
    double (*axis)[3];  /* a vector along the long axis of the section at each node; NULL unless flat */
};

/* Random streams of the parts of a cloth; a simulated scan uses STREAM_NOISE, STREAM_RING and STREAM_WHITE. */
enum cloth_stream {
    STREAM_YARN = 1,
    STREAM_FLYAWAY,
    STREAM_PILE,
    STREAM_FELT,
    STREAM_NOISE,
    STREAM_RING,
    STREAM_STAPLE,
    STREAM_DISORDER,
    STREAM_HAIR,
    STREAM_NAP,
    STREAM_WEB,
    STREAM_SPREAD,
    STREAM_SECTION,
    STREAM_WHITE,
    STREAM_FLAT,
    STREAM_FILM
};

void strand_set_release(struct strand_set *s);
/* Appends a strand of n nodes at zero. *node is the place to write them, valid until the next call.
 * STATUS_NO_MEMORY. */
status strand_add(struct strand_set *s, const struct strand *like, size_t n, double (**node)[3], struct error *err);

/* The long axes of the strand that was added last, to be written as its nodes are; NULL where all sections are round.
 * They need not be perpendicular to the strand nor of length 1. */
double (*strand_axis(const struct strand_set *s))[3];
/* The angle of the section of a fiber of a described cloth, in [0, pi). */
double strand_section_rad(uint64_t seed, uint32_t i_yarn, uint32_t i_fiber);
/* The section of a vertex of a fiber: a vector along its long axis and the ratio of both axes. */
struct strand_section {
    float axis[3], ratio;
};
/* Gives the fibers the sections of their vertices, with long axes across the fibers. STATUS_NO_MEMORY. */
status strand_set_sections(const struct strand_section *section, struct fiber_set *f, struct error *err);

/* Interpenetration and sharp bends that remain. */
struct strand_fit {
    /* Depth of interpenetration over the diameter: mean over all points of fibers, and the largest. */
    double overlap_mean, overlap_max;
    double strain_p95; /* of the surface of bent fibers (radius / radius of curvature): 95 % of the points stay below */
};

/* How contacts add up. STRAND_STEPS moves a node by the mean of its contacts. STRAND_SMOOTH weighs each by its depth,
 * so that the result has no steps where fibers begin to touch: small changes of the start make small changes. */
enum strand_rule { STRAND_STEPS, STRAND_SMOOTH };

struct strand_relax_option {
    size_t n_round;
    enum strand_rule rule;
};

/* Pushes nodes of different fibers apart until their distance is at least the sum of their radii, with smooth
 * displacements along fibers and no bends sharper than fibers can bear. fit: NULL saves a round, because its overlaps
 * take one. STATUS_NO_MEMORY, STATUS_CANCELLED. */
status strand_relax(struct strand_set *s, const struct strand_relax_option *o, struct thread_pool *pool,
                    const struct progress *progress, struct strand_fit *fit, struct error *err);

/* z of the lowest surface, round sections assumed; INFINITY without strands. */
double strand_lowest_m(const struct strand_set *s);
/* Cuts strands, subdivides them to the given spacing (Catmull-Rom through the nodes), and moves them to z_min =
 * margin. */
status strand_emit(const struct strand_set *s, double spacing_m, double margin_m, struct fiber_set *f,
                   struct error *err);

#endif
