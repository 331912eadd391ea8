/* Reads JSON that somebody else has written, in bounded memory. A tree of values takes up to seventy times the bytes of
 * its text, so the text is weighed before a tree is made of it. Members that nobody asks for are passed over without
 * being held: their nesting is checked, their grammar is not. */
#ifndef SELVEDGE_BASE_FOREIGN_JSON_H
#define SELVEDGE_BASE_FOREIGN_JSON_H

#include "base/status.h"

#include <jansson.h>
#include <stddef.h>

struct foreign_bounds {
    size_t file_bytes;         /* size of a file */
    size_t held_bytes;         /* memory of the values that are held, by an estimate from above */
    unsigned depth;            /* lists and objects within each other */
    const char *const *member; /* names of the members of the outermost object that are held, then NULL; NULL: all */
};

/* Makes a tree of n bytes, which the caller releases. *held (may be NULL): its estimated memory. STATUS_TOO_LARGE,
 * STATUS_FORMAT (no JSON, or no list or object), STATUS_NO_MEMORY. */
status foreign_json_parse(const char *text, size_t n, const struct foreign_bounds *bounds, size_t *held, json_t **json,
                          struct error *err);
/* The same of a file, which must hold an object and is opened as by foreign_file_open. Without memory for the whole
 * text of it. Besides STATUS_NOT_FOUND, STATUS_IO. */
status foreign_json_read(const char *folder, const char *name, const struct foreign_bounds *bounds, json_t **json,
                         struct error *err);

#endif
