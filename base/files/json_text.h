/* JSON that people write by hand: a byte order mark, which some editors save, is no fault, and errors that other
 * formats would forgive (a comma too many, comments, single quotes, True) are told in words. */
#ifndef SELVEDGE_JSON_TEXT_H
#define SELVEDGE_JSON_TEXT_H

#include "base/status.h"

#include <jansson.h>
#include <stddef.h>

/* Parses a text that the caller has checked by json_depth_check; the caller releases the value. `what` names the text
 * in the error, such as "the job document". NULL with STATUS_INVALID: it is not JSON, or a key appears twice. */
json_t *json_text_parse(const char *text, size_t n_bytes, const char *what, struct error *err);
/* The same of a file of at most 64 MiB. NULL with the status of reading it, or as above. */
json_t *json_text_file(const char *path, const char *what, struct error *err);

#endif
