/* The corrections of fibers that came from a scan or a file: properties that photographs can contradict, as numbers of
 * the whole cloth. geometry/fibers/shape/fiber_correct.h applies them. Constant data. */
#ifndef SELVEDGE_BASE_CORRECTION_NUMBERS_H
#define SELVEDGE_BASE_CORRECTION_NUMBERS_H

#include "base/catalogue/cloth_description.h"

enum correction_number { CORRECT_RADIUS, CORRECT_COMPRESSION, CORRECT_SMOOTHING, CORRECT_HAIRS, CORRECTION_N };

/* The rows of the catalogue, CORRECTION_N of them. */
extern const struct cloth_number_info correction_number_table[];

/* Sets the standard values: nothing is searched, no priors. */
void correction_numbers_init(struct cloth_number number[CORRECTION_N]);
/* Errors: from cloth_number_check_one. */
status correction_numbers_check(const struct cloth_number number[CORRECTION_N], struct error *err);

#endif
