#include "optimizer/photographs/rows/table_text.h"

#include <stdlib.h>
#include <string.h>

enum { NUMBER_BYTES = 64 };

char *table_text_begin(char *text)
{
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0) text += 3;
    for (char *p = text; *p != '\0'; p++)
        if (*p == '\r' && p[1] != '\n') *p = '\n'; /* the line ends of old Macintosh programs */
    return text;
}

bool table_text_is_utf16(const char *text, size_t n_bytes)
{
    return n_bytes >= 2 && (memcmp(text, "\xff\xfe", 2) == 0 || memcmp(text, "\xfe\xff", 2) == 0);
}

bool table_text_is_separator_line(const char *line, char *separator)
{
    if (strncmp(line, "sep=", 4) != 0 || line[4] == '\0' || line[5 + strspn(line + 5, "\r ")] != '\0') return false;
    *separator = line[4];
    return true;
}

char table_text_separator(const char *header)
{
    if (strchr(header, ';') != NULL) return ';';
    return strchr(header, '\t') != NULL && strchr(header, ',') == NULL ? '\t' : ',';
}

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/* Strips blanks, and the quotes around a cell. */
static char *strip(char *from, char *end)
{
    while (from < end && is_blank(*from)) from++;
    while (end > from && is_blank(end[-1])) end--;
    if (end > from + 1 && *from == '"' && end[-1] == '"') {
        from++;
        end--;
    }
    *end = '\0';
    return from;
}

/* The end of the cell that begins here: the separator, or the end of the line. Separators inside quotes belong to the
 * cell. */
static char *cell_end(char *from, char separator)
{
    char *p = from;
    while (is_blank(*p) && *p != separator) p++;
    if (*p == '"') {
        char *quote = strchr(p + 1, '"');
        if (quote != NULL) p = quote + 1;
    }
    while (*p != '\0' && *p != separator) p++;
    return p;
}

size_t table_text_split(char *line, char separator, char **cell, size_t max)
{
    size_t n = 0;
    for (char *p = line;;) {
        char *end = cell_end(p, separator);
        bool last = *end == '\0';
        char *text = strip(p, end);
        if (n == max) return max + 1;
        cell[n++] = text;
        if (last) return n;
        p = end + 1;
    }
}

bool table_text_number(const char *text, double *out)
{
    char copy[NUMBER_BYTES], *end;
    size_t n = strlen(text);
    char *comma;
    if (n == 0 || n >= sizeof copy) return false;
    memcpy(copy, text, n + 1);
    comma = strchr(copy, ',');
    if (comma != NULL && (strchr(copy, '.') != NULL || strchr(comma + 1, ',') != NULL)) return false;
    if (comma != NULL) *comma = '.';
    *out = strtod(copy, &end);
    return end != copy && *end == '\0';
}
