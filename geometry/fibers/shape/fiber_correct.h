/* Corrections of fibers that came from a scan or a file: properties that photographs can contradict, as numbers of the
 * whole cloth (base/catalogue/correction_numbers.h). At the standard values the fibers keep their bits. The result
 * follows every number smoothly: random numbers are a function of the hair's index, and hairs appear by growing from
 * length 0. */
#ifndef SELVEDGE_GEOMETRY_FIBER_CORRECT_H
#define SELVEDGE_GEOMETRY_FIBER_CORRECT_H

#include "base/catalogue/correction_numbers.h"
#include "geometry/fibers/fiber_set.h"

/* Writes the corrected fibers to `out` (initialised; its content is replaced). from != out. value: in the order and the
 * units of the table. STATUS_INVALID, with err->field naming the number, outside of the table's range;
 * STATUS_NO_MEMORY. */
status fiber_correct(const struct fiber_set *from, const double value[CORRECTION_N], struct fiber_set *out,
                     struct error *err);

#endif
