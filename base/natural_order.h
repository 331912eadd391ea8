/* The order of names in which runs of digits count as numbers: s2 before s10. */
#ifndef SELVEDGE_BASE_NATURAL_ORDER_H
#define SELVEDGE_BASE_NATURAL_ORDER_H

#include <stddef.h>

/* Returns a negative number, 0 or a positive one, as strcmp does. Different names never compare as equal: names whose
 * numbers are equal, such as s1 and s01, have the order of their bytes. */
int natural_compare(const char *a, const char *b);
/* The same for qsort and bsearch over an array of names. */
int natural_compare_names(const void *a, const void *b);

/* Writes the order for a person: "57 files: s000.tif, s001.tif ... s056.tif". Long names are cut in their middle. */
void natural_order_text(const char *const *name, size_t n, char *text, size_t n_text);

#endif
