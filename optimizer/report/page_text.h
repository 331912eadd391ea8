/* Pieces of an HTML page: escaped text, tables, numbers with as many digits as their errors justify. */
#ifndef SELVEDGE_OPTIMIZER_PAGE_TEXT_H
#define SELVEDGE_OPTIMIZER_PAGE_TEXT_H

#include <jansson.h>
#include <stdio.h>

/* Text with <, >, & and quotes escaped. NULL: nothing. */
void page_escaped(const char *text, FILE *out);
/* A value of JSON as people read it: text, number, yes or no, list "a, b"; "-" for null and for missing values. */
void page_value(const json_t *value, FILE *out);
/* The relative error `key` of an object with its standard error `key`_se, in words: "4.7 &plusmn; 0.1 %", "below 1.1 %"
 * (base/percent_words.h); "-" for a value that is no number. */
void page_percent(const json_t *object, const char *key, FILE *out);
/* "2.41 &plusmn; 0.05", in units of 1 / factor (100 for per cent); "-" for values that are no numbers. */
void page_with_error(const json_t *value, const json_t *se, double factor, const char *unit, FILE *out);
/* A table of the members of an object, members of objects inside as "a.b"; long lists are left out. */
void page_object(const json_t *object, FILE *out);
double page_number(const json_t *object, const char *key);      /* NaN when there is none */
const char *page_string(const json_t *object, const char *key); /* "" when there is none */

#endif
