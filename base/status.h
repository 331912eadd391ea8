/* Status codes and the caller-owned error record that every fallible function fills.
 *
 * Rule: a function that can fail returns `status` and takes `struct error *err` last; on failure it
 * fills err (if not NULL) and leaves its outputs untouched or releasable. Nothing below main() prints
 * or exits. Texts say what is wrong first, put the subject in quotes and end with the cause:
 * "cannot read volume 'silk.tif': page 211 is 8-bit, page 1 is 16-bit". Texts and fields are
 * always UTF-8: other bytes of what they quote become '?' (utf8.h).
 */
#ifndef SELVEDGE_BASE_STATUS_H
#define SELVEDGE_BASE_STATUS_H

#include <stdarg.h>
#include <stddef.h>

typedef enum status {
    STATUS_OK = 0,
    STATUS_INVALID, /* an argument, field or value that makes no sense; err->field names it */
    STATUS_FORMAT,  /* a file that is not what it claims to be */
    STATUS_IO,      /* the operating system said no; err->errno_value says why */
    STATUS_NO_MEMORY,
    STATUS_NOT_FOUND,
    STATUS_EXISTS,
    STATUS_CONFLICT, /* right request, wrong state */
    STATUS_CHECKSUM,
    STATUS_DISK_FULL,
    STATUS_TOO_LARGE, /* over a limit of the table of limits */
    STATUS_CANCELLED,
    STATUS_STALE,   /* a worker whose attempt token is no longer current */
    STATUS_NUMERIC, /* NaN, infinity, singular system */
    STATUS_UNSUPPORTED,
    STATUS_INTERNAL,
    STATUS_COUNT
} status;

struct error {
    status code;
    int errno_value; /* 0 when no system call is at fault */
    char where[48];  /* function that found it */
    char field[160]; /* job-document field or file at fault, "" when none */
    char text[640];  /* one sentence for the user */
};

/* Stable lower-case name of a code, used in JSON ("checksum", "disk_full"). */
const char *status_name(status code);

/* Fill err (NULL allowed) and return code, so that `return error_set(err, STATUS_IO, ...)` reads well. */
status error_set_at(struct error *err, status code, const char *where, const char *field, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
/* The same with errno appended as text; ENOSPC and EDQUOT become STATUS_DISK_FULL. */
status error_set_errno_at(struct error *err, const char *where, const char *field, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* Put "prefix: " before the text of an error on its way up (err NULL: nothing to do); returns code, which is that of the error. */
status error_prefix(struct error *err, status code, const char *format, ...) __attribute__((format(printf, 3, 4)));

#define error_set(err, code, ...) error_set_at((err), (code), __func__, "", __VA_ARGS__)
#define error_set_field(err, code, field, ...) error_set_at((err), (code), __func__, (field), __VA_ARGS__)
#define error_set_errno(err, ...) error_set_errno_at((err), __func__, "", __VA_ARGS__)

#endif
