/* A table of numbers as text (CSV), read line by line: cells between commas, semicolons or tabs, numbers with a decimal
 * point or comma (table_text.h). Lines that start with '#' are comments. The first other line names the columns, in any
 * order. Errors are STATUS_FORMAT or STATUS_INVALID with err->field the option of the table, and a text that names
 * file, line and column.
 */
#ifndef SELVEDGE_OPTIMIZER_NUMBER_TABLE_H
#define SELVEDGE_OPTIMIZER_NUMBER_TABLE_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { NUMBER_TABLE_MAX_CELL = 64, NUMBER_TABLE_MAX_COLUMN = 24 };

struct number_table {
    const char *file;               /* its name in errors */
    const char *option;             /* of base/option_id.h: the table's */
    const char *const *column_name; /* NULL-terminated, at most NUMBER_TABLE_MAX_COLUMN; the required ones first */
    size_t n_required;
    /* of the line that is read */
    size_t line;
    int place[NUMBER_TABLE_MAX_COLUMN]; /* the cell of a column, or -1 where the file does not have it */
    char *cell[NUMBER_TABLE_MAX_CELL];
    size_t n_cell, n_column;
    char separator; /* '\0' before the header or Excel's line "sep=;" has set it */
};

/* Sets and returns an error about the present line. */
#define number_table_error(t, code, ...)                                                                               \
    error_set_field(err, (code), (t)->option, "cannot use table '%s': line %zu: " __VA_ARGS__)

/* Reads a whole table, and calls header (may be NULL) after its first line, row for each other line. text:
 * NUL-terminated, n_bytes without the NUL. The caller fills in the first four members of t. */
status number_table_read(struct number_table *t, const char *text, size_t n_bytes,
                         status (*header)(void *context, struct number_table *t, struct error *err),
                         status (*row)(void *context, struct number_table *t, struct error *err), void *context,
                         struct error *err);

static inline bool number_table_has(const struct number_table *t, size_t column) { return t->place[column] >= 0; }
/* The text of a cell of the present row; "" where the file does not have the column. */
const char *number_table_text(const struct number_table *t, size_t column);
/* A finite number; `missing` where the file does not have the column. The other functions also require a range. */
status number_table_number(const struct number_table *t, size_t column, double missing, double *out, struct error *err);
status number_table_angle(const struct number_table *t, size_t column, double lower_deg, double upper_deg,
                          double *out_deg, struct error *err);
status number_table_not_negative(const struct number_table *t, size_t column, double missing, double upper, double *out,
                                 struct error *err);

#endif
