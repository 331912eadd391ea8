/* Indices of the exports in job_results.exported: the places of their rows EXPORT. */
#ifndef SELVEDGE_OPTIMIZER_JOB_EXPORTS_H
#define SELVEDGE_OPTIMIZER_JOB_EXPORTS_H

#include "optimizer/job/document/job_results.h"

enum {
#define EXPORT(name, ...) EXPORT_##name,
#include "generated/exports.def"
#undef EXPORT
    N_EXPORT
};
_Static_assert((int)N_EXPORT <= (int)JOB_MAX_EXPORT, "more exports than JOB_MAX_EXPORT");

#endif
