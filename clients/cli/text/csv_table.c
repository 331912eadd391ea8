#include "clients/cli/text/csv_table.h"
#include "base/files/durable.h"

#include <stdlib.h>
#include <string.h>

enum { TABLE_MOST_BYTES = 64 << 20 };

/* Reads one cell into `cell`, which has room for it. Returns where it ends: at ',', a line end or NUL; NULL when its
 * quote does not end. */
static const char *read_cell(const char *at, char *cell, size_t *n)
{
    *n = 0;
    if (*at != '"') {
        *n = strcspn(at, ",\r\n");
        memcpy(cell, at, *n);
        return at + *n;
    }
    for (at++; *at != '\0'; at++) {
        if (*at == '"' && at[1] != '"') return at + 1;
        if (*at == '"') at++;
        cell[(*n)++] = *at;
    }
    return NULL;
}

static status read_lines(const char *path, const char *text, char *cell, json_t *lines, struct error *err)
{
    size_t n_line = 1;
    for (const char *at = text; *at != '\0'; n_line++) {
        json_t *line = json_array();
        json_array_append_new(lines, line);
        for (;;) {
            size_t n;
            const char *end = read_cell(at, cell, &n);
            if (end == NULL || (*end != '\0' && strchr(",\r\n", *end) == NULL))
                return error_set(err, STATUS_INVALID, "table '%s', line %zu: a quoted text does not end properly", path,
                                 n_line);
            json_t *one = json_stringn(cell, n);
            if (one == NULL)
                return error_set(err, STATUS_INVALID, "table '%s', line %zu: the text is not UTF-8", path, n_line);
            json_array_append_new(line, one);
            at = end;
            if (*at != ',') break;
            at++;
        }
        if (*at == '\r') at++;
        if (*at == '\n') at++;
        const bool empty = json_array_size(line) == 1 && json_string_length(json_array_get(line, 0)) == 0;
        if (empty) json_array_remove(lines, json_array_size(lines) - 1);
    }
    return STATUS_OK;
}

status csv_table_read(const char *path, json_t **lines, struct error *err)
{
    char *text = NULL;
    size_t n = 0;
    status s = file_read_all(path, TABLE_MOST_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    char *cell = malloc(n + 1);
    *lines = json_array();
    if (cell == NULL || *lines == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", path);
    else if (strlen(text) != n)
        s = error_set(err, STATUS_INVALID, "table '%s' has a byte 0; is it a text file?", path);
    else
        s = read_lines(path, strncmp(text, "\xEF\xBB\xBF", 3) == 0 ? text + 3 : text, cell, *lines, err);
    free(cell);
    free(text);
    if (s == STATUS_OK) return s;
    json_decref(*lines);
    *lines = NULL;
    return s;
}
