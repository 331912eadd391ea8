/* Inside the phantom program: the configurations of lamp, camera and cloth for which it makes photographs. */
#ifndef SELVEDGE_OPTIMIZER_PHANTOM_VIEW_TABLE_H
#define SELVEDGE_OPTIMIZER_PHANTOM_VIEW_TABLE_H

#include "base/status.h"
#include "optimizer/job/document/job_photograph.h"

struct phantom_view_table {
    size_t n;
    struct job_photograph view[JOB_MAX_PHOTOGRAPH]; /* with file names, and a scale of 1 */
};

/* 16 configurations to fit and 24 held out: retroreflecting, mirror-like and crossed positions of lamp and camera, at
 * two rotations of the cloth. The tables of measured reflectance that the tests use have the same. */
void phantom_view_table_builtin(struct phantom_view_table *t);
/* Reads a CSV file: comment lines that begin with '#', a line of column names, then rows. The columns set,
 * light_theta_deg, light_phi_deg, camera_theta_deg and camera_phi_deg are required, cloth_rotation_deg is optional, and
 * others are ignored. Returns STATUS_FORMAT with a text that names file, line and column. */
status phantom_view_table_read(struct phantom_view_table *t, const char *path, struct error *err);

#endif
