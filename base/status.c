#include "base/status.h"
#include "base/utf8.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

static const char *const name[STATUS_COUNT] = {
    [STATUS_OK] = "ok",
    [STATUS_INVALID] = "invalid",
    [STATUS_FORMAT] = "format",
    [STATUS_IO] = "io",
    [STATUS_NO_MEMORY] = "no_memory",
    [STATUS_NOT_FOUND] = "not_found",
    [STATUS_EXISTS] = "exists",
    [STATUS_CONFLICT] = "conflict",
    [STATUS_CHECKSUM] = "checksum",
    [STATUS_DISK_FULL] = "disk_full",
    [STATUS_TOO_LARGE] = "too_large",
    [STATUS_CANCELLED] = "cancelled",
    [STATUS_STALE] = "stale",
    [STATUS_NUMERIC] = "numeric",
    [STATUS_UNSUPPORTED] = "unsupported",
    [STATUS_INTERNAL] = "internal",
};

const char *status_name(status code) { return (unsigned)code < STATUS_COUNT ? name[code] : "unknown"; }

static void fill(struct error *err, status code, int errno_value, const char *where, const char *field,
                 const char *format, va_list args)
{
    err->code = code;
    err->errno_value = errno_value;
    snprintf(err->where, sizeof err->where, "%s", where);
    /* format's arguments may point to err->text or err->field, so the text is built in a copy */
    char text[sizeof err->text];
    vsnprintf(text, sizeof text, format, args);
    char field_copy[sizeof err->field];
    snprintf(field_copy, sizeof field_copy, "%s", field == NULL ? "" : field);
    utf8_repair(text); /* both end up in JSON but may quote arbitrary bytes of files */
    utf8_repair(field_copy);
    memcpy(err->text, text, sizeof text);
    memcpy(err->field, field_copy, sizeof field_copy);
}

status error_set_at(struct error *err, status code, const char *where, const char *field, const char *format, ...)
{
    if (err == NULL) return code;
    va_list args;
    va_start(args, format);
    fill(err, code, 0, where, field, format, args);
    va_end(args);
    return code;
}

status error_set_errno_at(struct error *err, const char *where, const char *field, const char *format, ...)
{
    int saved = errno;
    status code = saved == ENOSPC || saved == EDQUOT ? STATUS_DISK_FULL
                  : saved == ENOMEM                  ? STATUS_NO_MEMORY
                  : saved == ENOENT                  ? STATUS_NOT_FOUND
                                                     : STATUS_IO;
    if (err == NULL) return code;
    va_list args;
    va_start(args, format);
    fill(err, code, saved, where, field, format, args);
    va_end(args);
    size_t used = strlen(err->text);
    snprintf(err->text + used, sizeof err->text - used, ": %s", strerror(saved));
    utf8_repair(err->text);
    return code;
}

status error_prefix(struct error *err, status code, const char *format, ...)
{
    if (err == NULL) return code;
    char prefix[sizeof err->text];
    va_list args;
    va_start(args, format);
    vsnprintf(prefix, sizeof prefix, format, args);
    va_end(args);
    char rest[sizeof err->text];
    memcpy(rest, err->text, sizeof rest);
    size_t used = (size_t)snprintf(err->text, sizeof err->text, "%s", prefix);
    if (used < sizeof err->text - 1) snprintf(err->text + used, sizeof err->text - used, ": %s", rest);
    utf8_repair(err->text);
    return code;
}
