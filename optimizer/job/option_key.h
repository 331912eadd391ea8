/* Keys of the job document for the option ids of base/option_id.h, which code below the pipeline uses in errors and
 * warnings.
 */
#ifndef SELVEDGE_OPTIMIZER_OPTION_KEY_H
#define SELVEDGE_OPTIMIZER_OPTION_KEY_H

#include "base/status.h"

#include <stddef.h>

/* "volume.files" for OPTION_SCAN_FILES; "[]" stands for the index of an element: "photographs[].file". NULL for a text that is
 * no option's id. */
const char *job_option_key(const char *id);

/* Writes the key that a field stands for, with its index ("photographs[3].file" for "photograph_file[3]"). Any other field
 * is copied. */
void job_option_resolve(const char *field, char *key, size_t n_bytes);

/* Puts the key into err->field, and empties a field that is neither an option's id nor a key: such a field names an argument
 * inside the program, and the text says what is wrong. err may be NULL. Returns code, so that `return job_option_name_field(s, err)` reads well. */
status job_option_name_field(status code, struct error *err);

#endif
