/* Paths of members of a JSON document, such as those by which the rows of a batch replace members of a template. */
#ifndef SELVEDGE_DOCUMENT_PATH_H
#define SELVEDGE_DOCUMENT_PATH_H

#include "base/status.h"

#include <jansson.h>

/* Replaces a member of a document. path: a JSON pointer (RFC 6901) if it begins with '/', else names between dots and
 * places in brackets, as in "photographs[2].scale". Objects that are missing on the way are made; a place of a list
 * must be there. Objects and lists on the way that other documents share (json_copy) are copied first, so that these do
 * not change; the value is shared. STATUS_INVALID: there is no such place, or the path has more than JSON_DEPTH_MOST
 * names, so that a document gets no deeper than twice as many levels. */
status document_replace(json_t *document, const char *path, const json_t *value, struct error *err);

#endif
