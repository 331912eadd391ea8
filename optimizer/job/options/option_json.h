/* The option table as JSON, for GET /v1/options and what is generated from it. */
#ifndef SELVEDGE_OPTIMIZER_OPTION_JSON_H
#define SELVEDGE_OPTIMIZER_OPTION_JSON_H

#include <jansson.h>

/* {"options": [...]} in the order of the document, one object a key:
 *
 *   path       "volume.filter.s", "photographs[].scale"; "" for the document itself
 *   kind       "section" and "list": their members are the rows under path and path[]; "number", "numbers",
 *              "number_or_numbers", "integer", "integers", "boolean", "choice", "text", "file_name", "file_names";
 *              "other": `schema` says what
 *   required   true where the key must stand in its section
 *   or_section true where an object of the rows under path is allowed as well
 *   unit, lower, upper, n (how many numbers), max_items, choices
 *   default    what holds without the key; where there is no such value, left_out says in words what holds
 *   allowed    in words, where range and choices do not say all
 *   schema     JSON Schema, added to what follows from the kind
 *   meaning    for people, Markdown
 *
 * Members that do not apply are left out. The caller owns the value; NULL when out of memory. */
json_t *job_options_json(void);

#endif
