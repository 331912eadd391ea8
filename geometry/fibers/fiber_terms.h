/* The statements of a job about a file of fibers. */
#ifndef SELVEDGE_GEOMETRY_FIBER_TERMS_H
#define SELVEDGE_GEOMETRY_FIBER_TERMS_H

#include "base/files/file_ledger.h"
#include "base/status.h"

struct fiber_file_terms {
    double radius_m;            /* of all fibers, for files that state none; NaN: not given */
    struct file_ledger *ledger; /* receives the file's other statements, or NULL */
};

/* Fills in the errors of a file without a radius, and of a radius that file and job both state. */
status fiber_terms_no_radius(const char *name, struct error *err);
status fiber_terms_two_radii(const char *name, struct error *err);

#endif
