#include "base/files/json_text.h"

#include "base/files/durable.h"
#include "base/files/json_depth.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_FILE_BYTES = 64 << 20 };

/* Whether the last character before `end` that is no space, and stands before the bracket of the error, is a comma. */
static bool comma_before(const char *text, size_t end, char bracket)
{
    while (end > 0 && text[end - 1] != bracket) end--;
    while (end > 0 && (text[end - 1] == bracket || isspace((unsigned char)text[end - 1]))) end--;
    return end > 0 && text[end - 1] == ',';
}

/* What somebody may have meant; "" if nothing is known. */
static const char *hint(const char *text, size_t n_bytes, const json_error_t *at)
{
    const char *near = strstr(at->text, "near '");
    const size_t end = at->position >= 0 && (size_t)at->position < n_bytes ? (size_t)at->position : n_bytes;
    if (near == NULL) return "";
    switch (near[6]) {
    case '}':
    case ']':
        return comma_before(text, end, near[6]) ? " (the comma before it is one too many)" : "";
    case '/':
    case '#':
        return " (JSON has no comments)";
    case '\'':
        return " (JSON has double quotes only)";
    case 'T':
    case 'F':
    case 'N':
        return " (JSON has true, false and null, and no numbers beside finite ones)";
    case '"':
        return " (is a comma missing before it?)";
    default:
        return "";
    }
}

json_t *json_text_parse(const char *text, size_t n_bytes, const char *what, struct error *err)
{
    static const char mark[] = {'\xEF', '\xBB', '\xBF'};
    json_error_t at;
    if (n_bytes >= sizeof mark && memcmp(text, mark, sizeof mark) == 0) text += sizeof mark, n_bytes -= sizeof mark;
    json_t *json = json_loadb(text, n_bytes, JSON_REJECT_DUPLICATES, &at);
    if (json == NULL)
        error_set(err, STATUS_INVALID, "%s is not valid JSON: line %d, column %d: %s%s", what, at.line, at.column,
                  at.text, hint(text, n_bytes, &at));
    return json;
}

json_t *json_text_file(const char *path, const char *what, struct error *err)
{
    char *text = NULL;
    size_t n_bytes = 0;
    json_t *json = NULL;
    status s = file_read_all(path, MOST_FILE_BYTES, &text, &n_bytes, err);
    if (s == STATUS_OK) s = json_depth_check(text, n_bytes, what, err);
    if (s == STATUS_OK) json = json_text_parse(text, n_bytes, what, err);
    free(text);
    return json;
}
