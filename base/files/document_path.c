#include "base/files/document_path.h"
#include "base/files/json_depth.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { NAME_BYTES = 128 };

/* Copies the next name of a JSON pointer, whose '/' has been read, without its escapes. Returns NULL when it is too
 * long or an escape is wrong. */
static const char *next_of_pointer(const char *at, char name[NAME_BYTES])
{
    size_t n = 0;
    for (; *at != '\0' && *at != '/'; at++) {
        char c = *at;
        if (c == '~') {
            at++;
            if (*at != '0' && *at != '1') return NULL;
            c = *at == '0' ? '~' : '/';
        }
        if (n + 1 == NAME_BYTES) return NULL;
        name[n++] = c;
    }
    name[n] = '\0';
    return *at == '/' ? at + 1 : at;
}

/* The same for names between dots; a place in brackets is a name of its own. */
static const char *next_of_names(const char *at, char name[NAME_BYTES])
{
    const bool place = *at == '[';
    if (place) at++;
    size_t n = strcspn(at, place ? "]" : ".[");
    if (n == 0 || n >= NAME_BYTES || (place && at[n] != ']')) return NULL;
    memcpy(name, at, n);
    name[n] = '\0';
    at += n + (place ? 1 : 0);
    if (place && *at != '\0' && *at != '.' && *at != '[') return NULL;
    if (*at == '.' && at[1] == '\0') return NULL;
    return *at == '.' ? at + 1 : at;
}

/* Reads the name of a list's member, its index. False: it is no index of the list. */
static bool index_of(const json_t *list, const char *name, size_t *i)
{
    if (name[0] == '\0' || strspn(name, "0123456789") != strlen(name) || strlen(name) > 9) return false;
    *i = (size_t)strtoul(name, NULL, 10);
    return *i < json_array_size(list);
}

static bool set_child(json_t *parent, const char *name, json_t *value)
{
    size_t i;
    if (json_is_object(parent)) return json_object_set_new(parent, name, value) == 0;
    if (json_is_array(parent) && index_of(parent, name, &i)) return json_array_set_new(parent, i, value) == 0;
    json_decref(value);
    return false;
}

static json_t *get_child(const json_t *parent, const char *name)
{
    size_t i;
    if (json_is_array(parent)) return index_of(parent, name, &i) ? json_array_get(parent, i) : NULL;
    return json_object_get(parent, name);
}

/* The member `name` of a parent, which is made an object if it is missing, and copied without its members if another
 * document has it too. NULL: there is no such place. */
static json_t *own_child(json_t *parent, const char *name)
{
    json_t *child = get_child(parent, name);
    if (child == NULL && json_is_object(parent)) set_child(parent, name, json_object());
    if (child != NULL && child->refcount > 1) set_child(parent, name, json_copy(child));
    return get_child(parent, name);
}

status document_replace(json_t *document, const char *path, const json_t *value, struct error *err)
{
    char name[NAME_BYTES];
    const bool pointer = path[0] == '/';
    const char *at = pointer ? path + 1 : path;
    json_t *parent = document;
    int n_name = 0;
    for (bool more = path[0] != '\0'; more;) {
        if (++n_name > JSON_DEPTH_MOST)
            return error_set(err, STATUS_INVALID, "the path '%.80s...' has more than %d names", path, JSON_DEPTH_MOST);
        const char *next = pointer ? next_of_pointer(at, name) : next_of_names(at, name);
        if (next == NULL) break;
        more = *next != '\0' || (pointer && next > at && next[-1] == '/');
        if (!more) {
            if (set_child(parent, name, json_incref((json_t *)(uintptr_t)value))) return STATUS_OK;
            return error_set(err, STATUS_INVALID, "the template has no place '%.160s'", path);
        }
        parent = own_child(parent, name);
        at = next;
        if (parent == NULL) return error_set(err, STATUS_INVALID, "the template has no place '%.160s'", path);
    }
    return error_set(err, STATUS_INVALID,
                     "'%.160s' is no path: write names between dots, as in 'list[2].name', or a JSON pointer, "
                     "as in '/list/2/name'",
                     path);
}
