/* The order of a scan that has a file for each slice, judged by the numbers in the names of its files. */
#ifndef SELVEDGE_GEOMETRY_SLICE_ORDER_H
#define SELVEDGE_GEOMETRY_SLICE_ORDER_H

#include "base/status.h"

#include <stddef.h>

struct slice_order {
    unsigned long long step; /* between the numbers of neighbours; 0: the names have no numbers */
};

/* Checks the names in the order in which they are read. Names without any digits pass. Otherwise the names must be
 * equal but for their numbers, and one of the numbers must rise or fall by the same step from file to file.
 * STATUS_INVALID, field OPTION_SCAN_FILES: names of two series, a number twice, names out of order, a gap, names that
 * count along two numbers (as channels do); each with the names at fault. STATUS_NO_MEMORY. */
status slice_order_check(const char *const *name, size_t n, struct slice_order *order, struct error *err);

#endif
