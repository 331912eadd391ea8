/* Inside the phantom program: the configurations that photographs are made under. */
#ifndef SELVEDGE_OPTIMIZER_PHANTOM_VIEW_TABLE_H
#define SELVEDGE_OPTIMIZER_PHANTOM_VIEW_TABLE_H

#include "optimizer/job/job_document.h"

struct phantom_view_table {
    size_t n;
    struct job_photograph view[JOB_MAX_PHOTOGRAPH]; /* file names set, scale 1 */
};

/* 16 configurations to fit and 24 held out: retroreflection, mirror-like and crossed positions at two rotations of the cloth, the same
 * as in the tables of measured reflectance that the tests use. */
void phantom_view_table_builtin(struct phantom_view_table *t);
/* CSV: '#' comments, a line of column names, then rows; set, light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg required,
 * cloth_rotation_deg optional, others ignored. STATUS_FORMAT naming file, line and column. */
status phantom_view_table_read(struct phantom_view_table *t, const char *path, struct error *err);

#endif
