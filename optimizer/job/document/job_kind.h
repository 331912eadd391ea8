/* The work of a job, by the sections that its document has. */
#ifndef SELVEDGE_OPTIMIZER_JOB_KIND_H
#define SELVEDGE_OPTIMIZER_JOB_KIND_H

#include <stddef.h>

enum job_kind {
    JOB_OF_GEOMETRY, /* ends with the geometry of its scan */
    JOB_OF_PICTURES, /* renders pictures of its cloth with the parameters that the document holds fixed */
    JOB_OF_FIT,      /* fits models to photographs or a table of measurements */
    JOB_OF_PROFILE   /* fits models to the profile of a single fiber; it has no cloth */
};

#endif
