/* Keys of the job document for the option ids of base/option_id.h, which code below the pipeline uses in errors and
 * warnings.
 */
#ifndef SELVEDGE_OPTIMIZER_OPTION_KEY_H
#define SELVEDGE_OPTIMIZER_OPTION_KEY_H

#include "base/status.h"

#include <stddef.h>

/* The key of an option id: "volume.files" for OPTION_SCAN_FILES. "[]" stands for the index of an element, as in
 * "photographs[].file". Returns NULL for a text that is no option's id. */
const char *job_option_key(const char *id);

/* Writes the key for an option id with an index: "photographs[3].file" for "photograph_file[3]". A field that is no
 * option's id is copied. */
void job_option_resolve(const char *field, char *key, size_t n_bytes);

/* Replaces the option id in err->field by its key. A field that is neither an option id nor a key is emptied, because
 * it names an argument inside the program; the text names the fault. err may be NULL. Returns code, so that a caller
 * can write `return job_option_name_field(s, err)`. */
status job_option_name_field(status code, struct error *err);

#endif
