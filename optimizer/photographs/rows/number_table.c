#include "optimizer/photographs/rows/number_table.h"
#include "base/word_guess.h"
#include "optimizer/photographs/rows/table_text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static status split(struct number_table *t, char *line, struct error *err)
{
    t->n_cell = table_text_split(line, t->separator, t->cell, NUMBER_TABLE_MAX_CELL);
    if (t->n_cell <= NUMBER_TABLE_MAX_CELL) return STATUS_OK;
    return number_table_error(t, STATUS_FORMAT, "more than %d cells", t->file, t->line, NUMBER_TABLE_MAX_CELL);
}

static status unknown_column(const struct number_table *t, const char *name, struct error *err)
{
    const char *meant = word_guess(name, t->column_name);
    if (meant == NULL) return number_table_error(t, STATUS_FORMAT, "unknown column '%.60s'", t->file, t->line, name);
    return number_table_error(t, STATUS_FORMAT, "unknown column '%.60s': did you mean '%s'?", t->file, t->line, name,
                              meant);
}

static status read_header(struct number_table *t, struct error *err)
{
    for (size_t c = 0; c < NUMBER_TABLE_MAX_COLUMN; c++) t->place[c] = -1;
    for (size_t i = 0; i < t->n_cell; i++) {
        size_t c = 0;
        while (t->column_name[c] != NULL && strcmp(t->column_name[c], t->cell[i]) != 0) c++;
        if (t->column_name[c] == NULL) return unknown_column(t, t->cell[i], err);
        if (t->place[c] >= 0)
            return number_table_error(t, STATUS_FORMAT, "column '%s' appears twice", t->file, t->line,
                                      t->column_name[c]);
        t->place[c] = (int)i;
    }
    t->n_column = t->n_cell;
    for (size_t c = 0; c < t->n_required; c++)
        if (t->place[c] < 0)
            return number_table_error(t, STATUS_FORMAT, "column '%s' is missing", t->file, t->line, t->column_name[c]);
    return STATUS_OK;
}

const char *number_table_text(const struct number_table *t, size_t column)
{
    return number_table_has(t, column) ? t->cell[t->place[column]] : "";
}

status number_table_number(const struct number_table *t, size_t column, double missing, double *out, struct error *err)
{
    *out = missing;
    if (!number_table_has(t, column)) return STATUS_OK;
    const char *text = number_table_text(t, column);
    if (!table_text_number(text, out))
        return number_table_error(t, STATUS_FORMAT, "column '%s': '%.40s' is not a number (write 1234.5 or 1234,5)",
                                  t->file, t->line, t->column_name[column], text);
    if (!isfinite(*out))
        return number_table_error(t, STATUS_INVALID, "column '%s' is '%.40s': it must be finite", t->file, t->line,
                                  t->column_name[column], text);
    return STATUS_OK;
}

status number_table_angle(const struct number_table *t, size_t column, double lower_deg, double upper_deg,
                          double *out_deg, struct error *err)
{
    status s = number_table_number(t, column, 0.0, out_deg, err);
    if (s != STATUS_OK) return s;
    if (*out_deg < lower_deg || *out_deg > upper_deg)
        return number_table_error(t, STATUS_INVALID, "column '%s' is %g degrees: allowed are %g to %g", t->file,
                                  t->line, t->column_name[column], *out_deg, lower_deg, upper_deg);
    return STATUS_OK;
}

status number_table_not_negative(const struct number_table *t, size_t column, double missing, double upper, double *out,
                                 struct error *err)
{
    status s = number_table_number(t, column, missing, out, err);
    if (s != STATUS_OK) return s;
    if (*out < 0.0 || *out > upper)
        return number_table_error(t, STATUS_INVALID, "column '%s' is %g: allowed are 0 to %g", t->file, t->line,
                                  t->column_name[column], *out, upper);
    return STATUS_OK;
}

/* Returns whether a line has separators alone. */
static bool is_empty(const struct number_table *t)
{
    for (size_t i = 0; i < t->n_cell; i++)
        if (t->cell[i][0] != '\0') return false;
    return true;
}

/* Splits a line. false: it is a comment or empty. */
static bool has_cells(struct number_table *t, char *line, status *s, struct error *err)
{
    size_t first = strspn(line, " \t\r");
    if (line[first] == '\0' || line[first] == '#') return false;
    if (t->separator == '\0') {
        if (table_text_is_separator_line(line, &t->separator)) return false;
        t->separator = table_text_separator(line);
    }
    *s = split(t, line, err);
    if (*s != STATUS_OK || is_empty(t)) return false;
    while (t->n_cell > t->n_column && t->cell[t->n_cell - 1][0] == '\0') t->n_cell--; /* of spreadsheet programs */
    return true;
}

status number_table_read(struct number_table *t, const char *text, size_t n_bytes,
                         status (*header)(void *context, struct number_table *t, struct error *err),
                         status (*row)(void *context, struct number_table *t, struct error *err), void *context,
                         struct error *err)
{
    status s = STATUS_OK;
    bool has_header = false;
    t->line = t->n_cell = t->n_column = 0;
    t->separator = '\0';
    if (table_text_is_utf16(text, n_bytes))
        return error_set_field(err, STATUS_FORMAT, t->option,
                               "cannot use table '%s': it is UTF-16 text: save it as CSV UTF-8", t->file);
    char *copy = malloc(n_bytes + 1);
    if (copy == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read table '%s': out of memory", t->file);
    memcpy(copy, text, n_bytes);
    copy[n_bytes] = '\0';
    if (strlen(copy) != n_bytes)
        s = error_set_field(err, STATUS_FORMAT, t->option, "cannot use table '%s': it is not text (zero byte)",
                            t->file);
    for (char *p = table_text_begin(copy); s == STATUS_OK && p != NULL && *p != '\0';) {
        char *end = strchr(p, '\n'), *line = p;
        if (end != NULL) *end = '\0';
        p = end != NULL ? end + 1 : NULL;
        t->line++;
        if (!has_cells(t, line, &s, err)) continue;
        if (!has_header) {
            s = read_header(t, err);
            if (s == STATUS_OK && header != NULL) s = header(context, t, err);
        } else if (t->n_cell != t->n_column)
            s = number_table_error(t, STATUS_FORMAT, "%zu cells, but the header has %zu columns", t->file, t->line,
                                   t->n_cell, t->n_column);
        else
            s = row(context, t, err);
        has_header = true;
    }
    if (s == STATUS_OK && !has_header)
        s = error_set_field(err, STATUS_FORMAT, t->option, "cannot use table '%s': it has no header line", t->file);
    free(copy);
    return s;
}
