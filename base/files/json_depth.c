#include "base/files/json_depth.h"

#include <stdbool.h>

status json_depth_check(const char *text, size_t n_bytes, const char *what, struct error *err)
{
    size_t depth = 0, n_value = 1;
    bool in_string = false;
    for (size_t i = 0; i < n_bytes; i++) {
        const char c = text[i];
        if (in_string && c == '\\')
            i++;
        else if (c == '"')
            in_string = !in_string;
        else if (!in_string && (c == '{' || c == '['))
            depth++;
        else if (!in_string && (c == '}' || c == ']') && depth > 0)
            depth--;
        if (!in_string && (c == '{' || c == '[' || c == ',')) n_value++;
        if (n_value > JSON_VALUES_MOST)
            return error_set(err, STATUS_INVALID, "%s has more than %d values", what, JSON_VALUES_MOST);
        if (depth > JSON_DEPTH_MOST)
            return error_set(err, STATUS_INVALID, "%s has more than %d levels of objects and lists inside each other",
                             what, JSON_DEPTH_MOST);
    }
    return STATUS_OK;
}
