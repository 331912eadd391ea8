/* Strands, the working form of fibers while a phantom is made (used only in this folder).
 *
 * A strand is a chain of nodes about one radius apart. A closed strand runs through n_period tiles before it meets
 * itself again: its node n is node 0 moved by `shift`. An open strand ends at its last node. Lengths are in metres,
 * before the tile is moved to its place in z. */
#ifndef SELVEDGE_GEOMETRY_PHANTOM_STRAND_H
#define SELVEDGE_GEOMETRY_PHANTOM_STRAND_H

#include "geometry/phantom/phantom.h"

/* Where a closed strand is cut into fibers. */
enum strand_cut { CUT_NONE, CUT_FACE_X = 1, CUT_FACE_Y = 2, CUT_FACE_XY = 3, CUT_PERIOD = 4 };

struct strand {
    size_t first, n; /* nodes */
    double shift[2]; /* of a closed strand; 0, 0 if open */
    size_t n_period; /* 0: open */
    double radius_m;
    uint8_t axis_class;
    uint8_t group; /* of its fibers (fiber_set.h) */
    enum strand_cut cut;
};

struct strand_set {
    double tile_m[2];
    size_t n_strand, strand_capacity;
    struct strand *strand;
    size_t n_node, node_capacity;
    double (*start)[3];         /* where the design put the node */
    double (*p)[3];             /* where it is now */
    struct phantom_plied plied; /* properties of a real yarn as made */
};

void strand_set_release(struct strand_set *s);
/* Appends a strand of n nodes at zero. *node is the place to write them, valid until the next call.
 * STATUS_NO_MEMORY. */
status strand_add(struct strand_set *s, const struct strand *like, size_t n, double (**node)[3], struct error *err);

/* Pushes nodes of different fibers apart until their distance is at least the sum of their radii, with smooth
 * displacements along fibers and no bends sharper than fibers can bear. Sets the overlaps and the strain of the
 * report. STATUS_NO_MEMORY, STATUS_CANCELLED. */
status strand_relax(struct strand_set *s, size_t n_round, struct thread_pool *pool, const struct progress *progress,
                    struct phantom_report *report, struct error *err);

/* Cuts strands, subdivides them to the given spacing (Catmull-Rom through the nodes), and moves them to z_min =
 * margin. */
status strand_emit(const struct strand_set *s, double spacing_m, double margin_m, struct fiber_set *f,
                   struct error *err);

/* The path of a yarn over one tile, closed on the torus: n points, and point n = point 0 + shift. */
struct yarn {
    size_t n;
    double (*point)[3];
    double shift[2];
    double radius_m; /* radius of its fibers */
    uint8_t axis_class;
    enum strand_cut cut;
    uint32_t number; /* selects its random stream */
};

/* The map from a section to space. */
struct yarn_section {
    double wide, high; /* area-preserving flattening */
    double twist_turns, length_m;
};

/* Greatest common divisor, where 0 is allowed. After a / gcd(a, k) steps of k a ring of length a is closed. */
static inline size_t greatest_divisor(size_t a, size_t b) { return b == 0 ? a : greatest_divisor(b, a % b); }

double yarn_length_m(const struct yarn *y);
/* Computes the point (u, v) of the section before flattening, s tiles along the yarn: u in the plane of the cloth, v
 * upwards. */
void yarn_point(const struct yarn *y, const struct yarn_section *c, double s, double u_m, double v_m, double out[3]);

/* The two functions below for yarns with plies. */
double plied_section_radius_m(const struct phantom_option *o, double fiber_radius_m);
status plied_yarn_add(struct strand_set *s, const struct phantom_option *o, const struct yarn *y, struct error *err);

/* Radius of a yarn's round section, to the surface of the outermost fiber. */
double yarn_section_radius_m(const struct phantom_option *o, double fiber_radius_m);
/* Adds the fibers of one yarn and its fly-aways. */
status yarn_add(struct strand_set *s, const struct phantom_option *o, const struct yarn *y, struct error *err);

/* Fill the set; o has been checked. They set tile_m to whole voxels. */
status weave_make(struct strand_set *s, const struct phantom_option *o, struct phantom_report *r, struct error *err);
status knit_make(struct strand_set *s, const struct phantom_option *o, struct phantom_report *r, struct error *err);
status felt_make(struct strand_set *s, const struct phantom_option *o, struct error *err);
status pile_add(struct strand_set *s, const struct phantom_option *o, double ground_z_m, struct error *err);

/* Random streams of the parts of a phantom. */
enum phantom_stream { STREAM_YARN = 1, STREAM_FLYAWAY, STREAM_PILE, STREAM_FELT, STREAM_NOISE, STREAM_RING };

#endif
