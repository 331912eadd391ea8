/* Status codes, and the error record, owned by the caller, that every function that can fail fills in.
 *
 * A function that can fail returns `status` and takes `struct error *err` as its last parameter. On failure it fills
 * err (if not NULL) and leaves its outputs untouched or releasable. No function below main() prints or exits. Texts
 * name the fault first, put the subject in quotes and end with the cause: "cannot read volume 'silk.tif': page 211 is
 * 8-bit, page 1 is 16-bit". Texts and fields are always UTF-8: other bytes of quoted text become '?' (utf8.h). */
#ifndef SELVEDGE_BASE_STATUS_H
#define SELVEDGE_BASE_STATUS_H

#include <stdarg.h>
#include <stddef.h>

typedef enum status {
    STATUS_OK = 0,
    STATUS_INVALID, /* an argument, field or value is not allowed; err->field names it */
    STATUS_FORMAT,  /* a file does not have the format that it should have */
    STATUS_IO,      /* a system call failed; err->errno_value has its errno */
    STATUS_NO_MEMORY,
    STATUS_NOT_FOUND,
    STATUS_EXISTS,
    STATUS_CONFLICT, /* the request is valid but not possible in the present state */
    STATUS_CHECKSUM,
    STATUS_DISK_FULL,
    STATUS_TOO_LARGE, /* over one of the limits on sizes and counts */
    STATUS_CANCELLED,
    STATUS_STALE,   /* the attempt token of a worker, or the ticket of an upload, is no longer current */
    STATUS_NUMERIC, /* NaN, infinity or a singular system */
    STATUS_UNSUPPORTED,
    STATUS_INTERNAL,
    STATUS_COUNT
} status;

struct error {
    status code;
    int errno_value; /* 0 when the cause is not a system call */
    char where[48];  /* name of the function that found the error */
    char field[160]; /* key of the job document, or file, that is wrong; "" if none */
    char text[640];  /* one sentence for the user */
};

/* Returns the lower-case name of a code as used in JSON ("checksum", "disk_full"). Names never change. */
const char *status_name(status code);

/* Fills err (may be NULL) and returns code, so that callers can write `return error_set(err, STATUS_IO, ...)`. */
status error_set_at(struct error *err, status code, const char *where, const char *field, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
/* The same with the text of errno appended. The code follows from errno: STATUS_DISK_FULL for ENOSPC and EDQUOT,
 * STATUS_NO_MEMORY, STATUS_NOT_FOUND, or else STATUS_IO. */
status error_set_errno_at(struct error *err, const char *where, const char *field, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* Puts "prefix: " before the text of an error (err may be NULL) and returns its code, which the caller passes. */
status error_prefix(struct error *err, status code, const char *format, ...) __attribute__((format(printf, 3, 4)));

#define error_set(err, code, ...) error_set_at((err), (code), __func__, "", __VA_ARGS__)
#define error_set_field(err, code, field, ...) error_set_at((err), (code), __func__, (field), __VA_ARGS__)
#define error_set_errno(err, ...) error_set_errno_at((err), __func__, "", __VA_ARGS__)

#endif
