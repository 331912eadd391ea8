#include "base/files/json_member.h"

#include <string.h>

static bool in_range(const json_t *x, const struct json_member *m)
{
    const double value = json_number_value(x);
    return value >= m->least && value <= m->most;
}

static bool fits(const json_t *x, const struct json_member *m)
{
    if (json_is_null(x)) return m->or_null;
    switch (m->kind) {
    case JSON_IS_TEXT:
        return json_is_string(x);
    case JSON_IS_NUMBER:
        return json_is_number(x) && in_range(x, m);
    case JSON_IS_WHOLE:
        return json_is_integer(x) && in_range(x, m);
    case JSON_IS_FLAG:
        return json_is_boolean(x);
    case JSON_IS_OBJECT:
        return json_is_object(x);
    case JSON_IS_LIST:
        return json_is_array(x);
    }
    return false;
}

static const struct json_member *find(const struct json_member *member, size_t n, const char *name)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(member[i].name, name) == 0) return &member[i];
    return NULL;
}

bool json_members_keep(json_t *object, const struct json_member *member, size_t n, bool only)
{
    const char *name;
    json_t *x;
    void *next;
    size_t n_fit = 0;
    json_object_foreach_safe(object, next, name, x)
    {
        const struct json_member *m = find(member, n, name);
        if (m == NULL ? only : !fits(x, m))
            json_object_del(object, name);
        else
            n_fit += m != NULL;
    }
    return json_is_object(object) && n_fit == n;
}

void json_items_keep(json_t *list, const struct json_member *member, size_t n)
{
    for (size_t i = json_array_size(list); i > 0; i--)
        if (!json_members_keep(json_array_get(list, i - 1), member, n, true)) json_array_remove(list, i - 1);
}

void json_texts_keep(json_t *list)
{
    for (size_t i = json_array_size(list); i > 0; i--)
        if (!json_is_string(json_array_get(list, i - 1))) json_array_remove(list, i - 1);
}
