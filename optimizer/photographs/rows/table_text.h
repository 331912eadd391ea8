/* Tables as spreadsheet programs write them: cells between commas, semicolons or tabs, decimal commas, quoted cells, a
 * byte order mark, any line ends, and Excel's line "sep=;". */
#ifndef SELVEDGE_OPTIMIZER_TABLE_TEXT_H
#define SELVEDGE_OPTIMIZER_TABLE_TEXT_H

#include "base/status.h"

#include <stdbool.h>

/* Prepares NUL-terminated text in place: drops the byte order mark, and turns all line ends into '\n'. Returns the
 * first character. */
char *table_text_begin(char *text);
/* Returns whether text of n_bytes is UTF-16, as Excel's "Unicode text" is. */
bool table_text_is_utf16(const char *text, size_t n_bytes);
/* Returns whether a line is "sep=X"; sets the separator then. */
bool table_text_is_separator_line(const char *line, char *separator);
/* The separator of a header line: ';' or a tab where it has one, else ','. */
char table_text_separator(const char *header);
/* Cuts a line into at most max cells, strips blanks and quotes, in place. Returns the number of cells,
 * max + 1 when there are more. */
size_t table_text_split(char *line, char separator, char **cell, size_t max);
/* A number with a decimal point, or with a decimal comma. False when text is neither, as with separators of
 * thousands. */
bool table_text_number(const char *text, double *out);

#endif
