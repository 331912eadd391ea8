#include "server/jobs/job_tags.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"

#include <stdio.h>
#include <string.h>

enum { TAG_MOST = 16, TAG_BYTES = 40 };

static bool tag_valid(const char *tag)
{
    size_t n = strlen(tag);
    for (size_t i = 0; i < n; i++) {
        unsigned char c = (unsigned char)tag[i];
        if (c <= ' ' || c == 127 || c == ',') return false;
    }
    return n > 0 && n <= TAG_BYTES;
}

status job_tags_check(const json_t *list, const char *field, struct error *err)
{
    size_t i;
    const json_t *one;
    if (list == NULL) return STATUS_OK;
    if (!json_is_array(list) || json_array_size(list) > TAG_MOST)
        return error_set_field(err, STATUS_INVALID, field, "'%s' must be a list of at most %d tags", field,
                               (int)TAG_MOST);
    json_array_foreach(list, i, one)
    {
        if (json_is_string(one) && tag_valid(json_string_value(one))) continue;
        char place[80];
        snprintf(place, sizeof place, "%s[%zu]", field, i);
        return error_set_field(err, STATUS_INVALID, place,
                               "a tag must have 1 to %d bytes, without spaces, commas and control characters",
                               (int)TAG_BYTES);
    }
    return STATUS_OK;
}

json_t *job_tags_json(const struct job_row *row)
{
    json_t *list = json_array();
    for (const char *at = row->tags + strspn(row->tags, " "); *at != '\0'; at += strspn(at, " ")) {
        size_t n = strcspn(at, " ");
        json_array_append_new(list, json_stringn(at, n));
        at += n;
    }
    return list;
}

static bool holds(const json_t *list, const char *tag)
{
    size_t i;
    const json_t *one;
    json_array_foreach(list, i, one) if (strcmp(json_string_value(one), tag) == 0) return true;
    return false;
}

/* Appends the tags of list, each once, except the tags in `not`. */
static void append(json_t *to, const json_t *list, const json_t * not )
{
    size_t i;
    json_t *one;
    json_array_foreach(list, i, one)
    {
        const char *tag = json_string_value(one);
        if (tag != NULL && !holds(to, tag) && !holds(not, tag)) json_array_append(to, one);
    }
}

static status write_tags(struct job_row *row, const json_t *tags, struct error *err)
{
    size_t i, n = 0;
    const json_t *one;
    if (json_array_size(tags) > TAG_MOST)
        return error_set_field(err, STATUS_INVALID, "tags", "a job may have at most %d tags", (int)TAG_MOST);
    memset(row->tags, 0, sizeof row->tags);
    json_array_foreach(tags, i, one) n +=
        (size_t)snprintf(row->tags + n, sizeof row->tags - n, "%s%s ", n == 0 ? " " : "", json_string_value(one));
    return STATUS_OK;
}

status job_edit_tags(struct job_service *v, const char *id, const struct tag_edit *edit, bool *changed,
                     struct error *err)
{
    struct job_row row;
    char before[STORE_TAGS_BYTES];
    *changed = false;
    job_change_begin(v, id, NULL);
    status s = job_look(v, id, &row, err);
    if (s != STATUS_OK) goto out;
    json_t *had = job_tags_json(&row), *tags = json_array();
    if (!edit->replace) append(tags, had, edit->remove);
    append(tags, edit->add, NULL);
    memcpy(before, row.tags, sizeof before);
    s = write_tags(&row, tags, err);
    json_decref(had);
    json_decref(tags);
    *changed = s == STATUS_OK && strcmp(before, row.tags) != 0;
    if (*changed) s = job_update_surely(v, &row, err);
out:
    job_change_end(v);
    return s;
}
