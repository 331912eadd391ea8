/* Strict reading of JSON objects. On an error every function returns STATUS_INVALID, puts the path of the field at
 * fault ("photographs[3].scale") into err->field and names the allowed values in err->text. A key that is absent leaves
 * *out unchanged and is no error, unless the function's name or argument says `required`. */
#ifndef SELVEDGE_OPTIMIZER_JSON_FIELD_H
#define SELVEDGE_OPTIMIZER_JSON_FIELD_H

#include "base/status.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

enum { JSON_PATH_BYTES = 160 };

/* An object and its path in the document ("" for the document itself). */
struct json_field {
    const json_t *object;
    char path[JSON_PATH_BYTES];
};

/* Path of a key: "lamp" + "side_cm" -> "lamp.side_cm". */
void json_field_path(const struct json_field *f, const char *key, char path[JSON_PATH_BYTES]);
/* An error when f->object is no object, or has a key that is not in the NULL-terminated list. */
status json_field_check_keys(const struct json_field *f, const char *const *allowed, struct error *err);
/* The object under a key; *present says whether the key is there. */
status json_field_object(const struct json_field *f, const char *key, struct json_field *sub, bool *present,
                         struct error *err);

/* Numbers must be finite and in [lower, upper]. */
status json_field_number(const struct json_field *f, const char *key, double lower, double upper, double *out,
                         struct error *err);
status json_field_required_number(const struct json_field *f, const char *key, double lower, double upper, double *out,
                                  struct error *err);
/* Exactly n numbers. */
status json_field_number_array(const struct json_field *f, const char *key, size_t n, double lower, double upper,
                               double *out, struct error *err);
status json_field_size(const struct json_field *f, const char *key, size_t lower, size_t upper, size_t *out,
                       struct error *err);
status json_field_size_array(const struct json_field *f, const char *key, size_t n, size_t lower, size_t upper,
                             size_t *out, struct error *err);
status json_field_u64(const struct json_field *f, const char *key, uint64_t lower, uint64_t *out, struct error *err);
status json_field_bool(const struct json_field *f, const char *key, bool *out, struct error *err);
/* One word of the NULL-terminated list; *index is its index there. */
status json_field_choice(const struct json_field *f, const char *key, const char *const *allowed, size_t *index,
                         struct error *err);
/* UTF-8 text of 1..n_bytes-1 bytes without control characters; out has n_bytes. */
status json_field_text(const struct json_field *f, const char *key, bool required, char *out, size_t n_bytes,
                       struct error *err);

/* Writes a NULL-terminated list as "a, b, c". The text is cut when it does not fit. */
void json_list_text(const char *const *list, char *text, size_t n_bytes);

#endif
