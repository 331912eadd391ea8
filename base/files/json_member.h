/* Takes out of a foreign JSON object whatever has not the kind and the range that its readers, and theirs, expect. */
#ifndef SELVEDGE_BASE_JSON_MEMBER_H
#define SELVEDGE_BASE_JSON_MEMBER_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

enum json_kind { JSON_IS_TEXT, JSON_IS_NUMBER, JSON_IS_WHOLE, JSON_IS_FLAG, JSON_IS_OBJECT, JSON_IS_LIST };

/* One member of an object. Numbers must lie in least..most. */
struct json_member {
    const char *name;
    enum json_kind kind;
    bool or_null;
    double least, most;
};

/* Removes the members of an object that do not fit, and with `only` those that are not in the table. Returns whether
 * the object has all members of the table now; false for a value that is no object. */
bool json_members_keep(json_t *object, const struct json_member *member, size_t n, bool only);
/* Removes the items of a list that are no objects with all members of the table, and their other members. */
void json_items_keep(json_t *list, const struct json_member *member, size_t n);
/* Removes the items of a list that are no texts. */
void json_texts_keep(json_t *list);

#endif
