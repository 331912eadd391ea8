/* The option table as JSON, for GET /v1/options and for generated documents. */
#ifndef SELVEDGE_OPTIMIZER_OPTION_JSON_H
#define SELVEDGE_OPTIMIZER_OPTION_JSON_H

#include <jansson.h>
#include <stdbool.h>

/* Returns {"options": [...]} in the order of the document, with one object for each key:
 *
 *   path       "volume.filter.s", "photographs[].scale"; "" for the document itself
 *   kind       "section" and "list": their members are the rows under path and path[]; "number", "numbers",
 *              "number_or_numbers", "integer", "integers", "boolean", "choice", "text", "file_name", "file_names";
 *              "other": `schema` describes the value
 *   required   true when its section must have the key
 *   or_section true when an object of the rows under path is allowed as well
 *   unit, lower, upper, n (number of elements), max_items, choices
 *   default    the value that holds without the key; left_out describes it in words when there is no such value
 *   allowed    in words, when range and choices are not the whole condition
 *   schema     JSON Schema, added to the schema that follows from the kind
 *   meaning    a description for people, in Markdown
 *
 * Members that do not apply are left out. The caller owns the value; NULL when out of memory. */
json_t *job_options_json(void);
/* Settings that a document leaves at their defaults, {"fit.seed": 1}, as far as they have an effect: their section is
 * given, or every job with rows has it. Settings of `cloth` are left out, because the result states all of them that
 * are in use. The caller owns the value. */
json_t *job_options_defaults_json(const json_t *document, bool has_rows);

#endif
