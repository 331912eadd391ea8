/* The choice of one channel, or one time, of a scan that has several. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_PART_H
#define SELVEDGE_GEOMETRY_VOLUME_PART_H

#include "base/status.h"
#include "geometry/volume/format/volume_info.h"

/* Several volumes in one file: of n[0] channels and n[1] times; 0 counts as 1. */
enum { VOLUME_CHANNELS, VOLUME_TIMES };
struct volume_parts {
    size_t n[2];
    const char *source; /* where the file says so: "ImageJ's description" */
};

/* Writes the indices of the part that is read, from 0, and enters several channels or times into the ledger. part: NULL
 * or 0 for what is not chosen. name: of the file, for errors. STATUS_INVALID, fields OPTION_SCAN_CHANNEL,
 * OPTION_SCAN_TIME: the file has several of which none is chosen, or not the chosen one. */
status volume_part_choose(const char *name, const struct volume_parts *parts, const struct volume_part *part,
                          size_t index[2], struct file_ledger *ledger, struct error *err);

#endif
