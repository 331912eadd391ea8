/* Tables and words for a terminal: columns as wide as what is in them, and colors where a person reads. */
#ifndef SELVEDGE_CLIENTS_TEXT_TABLE_H
#define SELVEDGE_CLIENTS_TEXT_TABLE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

enum { TEXT_MAX_COLUMN = 8 };

/* Whether a stream gets colors: it is a terminal that has some (TERM is not "dumb"), and NO_COLOR is unset or empty
 * (https://no-color.org). */
bool text_colored(FILE *out);
/* Writes a word; if `colored`, in the color of its meaning: states and verdicts, "fault" and "error", "warning". Other
 * words have none. */
void text_put_word(const char *word, bool colored, FILE *out);

/* A table whose rows are printed in pieces. Set `head` to the titles of the columns, NULL behind the last one. A title
 * that begins with '>' has its values at the right, one that begins with '*' has words as above. */
struct text_table {
    const char *const *head;
    bool colored;
    bool has_head;                 /* the titles are printed */
    size_t width[TEXT_MAX_COLUMN]; /* of the columns so far */
    json_t *row;                   /* lists of texts that are not printed yet */
};

/* Adds a row: a text for each title. Control characters are replaced (text_clean). */
void text_table_add(struct text_table *t, const char *const *cell);
/* Prints the rows that were added since the last call, before the first ones the titles, and forgets them. Columns
 * never become narrower from one piece to the next. */
void text_table_print(struct text_table *t, FILE *out);

#endif
