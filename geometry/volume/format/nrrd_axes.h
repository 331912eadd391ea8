/* The fields of an NRRD header that describe its axes: sizes, kinds, lengths, directions. */
#ifndef SELVEDGE_GEOMETRY_NRRD_AXES_H
#define SELVEDGE_GEOMETRY_NRRD_AXES_H

#include "geometry/volume/format/header_axes.h"

struct nrrd_axes {
    size_t n; /* "dimension"; 0: not stated yet, so no other field can be read */
    struct header_axes all;
    double spacing[HEADER_MAX_AXIS], least[HEADER_MAX_AXIS], most[HEADER_MAX_AXIS];
    double unit_m[HEADER_MAX_AXIS], space_unit_m[3];
    bool has_size, has_kind, is_node[HEADER_MAX_AXIS], left_handed;
};

void nrrd_axes_init(struct nrrd_axes *m);
/* Reads a field, if it concerns the axes. `ledger` takes the statements that have no use. STATUS_FORMAT. */
status nrrd_axes_parse(struct nrrd_axes *m, const struct volume_header *h, const char *key, const char *value,
                       struct file_ledger *ledger, struct error *err);
/* Enters a pair "key:=value" that names the voxels, such as a padding value. */
void nrrd_state_pair(struct volume_source_info *info, const char *key, const char *value);
/* As header_axes_settle. */
status nrrd_axes_settle(struct nrrd_axes *m, struct volume_header *h, const struct volume_part *part,
                        struct volume_source_info *info, struct error *err);

#endif
