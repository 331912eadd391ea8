#include "server/jobs/problem_code.h"

#include <string.h>

static const struct http_problem of_status[STATUS_COUNT] = {
    [STATUS_OK] = {"internal", 500, "An error without a known cause"},
    [STATUS_INVALID] = {"invalid", 422, "A value is not allowed"},
    [STATUS_FORMAT] = {"format", 422, "A file is not what it claims to be"},
    [STATUS_IO] = {"io", 500, "The operating system refused"},
    [STATUS_NO_MEMORY] = {"no_memory", 503, "Out of memory"},
    [STATUS_NOT_FOUND] = {"not_found", 404, "Not found"},
    [STATUS_EXISTS] = {"exists", 409, "It exists already"},
    [STATUS_CONFLICT] = {"conflict", 409, "Not possible in this state"},
    [STATUS_CHECKSUM] = {"checksum", 422, "The checksum differs"},
    [STATUS_DISK_FULL] = {"disk_full", 507, "The disk is full"},
    [STATUS_TOO_LARGE] = {"too_large", 413, "Too large"},
    [STATUS_CANCELLED] = {"cancelled", 409, "Cancelled"},
    [STATUS_STALE] = {"stale", 409, "Another request has taken over"},
    [STATUS_NUMERIC] = {"numeric", 422, "Not a number"},
    [STATUS_UNSUPPORTED] = {"unsupported", 422, "Not supported"},
    [STATUS_INTERNAL] = {"internal", 500, "Internal error"},
};

static const struct http_problem of_code[] = {
    {"malformed", 400, "The request cannot be understood"},
    {"length_and_chunked", 400, "The length of the body is ambiguous"},
    {"duplicate_header", 400, "A header appears twice"},
    {"host", 400, "The Host header does not name this machine"},
    {"token", 401, "A valid access token is required"},
    {"scope", 403, "The access token does not allow this"},
    {"origin", 403, "The request comes from another site"},
    {"method", 405, "The method is not allowed here"},
    {"too_slow", 408, "The request came too slowly"},
    {"files_missing", 409, "Input files are not complete"},
    {"offset", 409, "The offset is not the present one"},
    {"length_required", 411, "A Content-Length is required"},
    {"precondition", 412, "The resource has changed"},
    {"tus_version", 412, "Tus-Resumable: 1.0.0 is required"},
    {"content_type", 415, "The content type is not supported"},
    {"range", 416, "The range is outside the file"},
    {"idempotency_key_reused", 422, "The key was used with another body"},
    {"too_many", 429, "Too many"},
    {"rate", 429, "Too many requests in a minute"},
    {"address_too_long", 414, "The address is too long"},
    {"head_too_large", 431, "The head of the request is too large"},
    {"busy", 503, "Too many requests at the same time"},
    {"http_version", 505, "The HTTP version is not supported"},
    {"not_ready", 503, "The service cannot take new work"},
    {"stopping", 503, "The service is stopping"},
    {"quota", 507, "A quota of the access token is used up"},
};

const struct http_problem *http_problem_of_status(status code)
{
    return &of_status[code < STATUS_COUNT ? code : STATUS_INTERNAL];
}

const struct http_problem *http_problem_of_code(const char *code)
{
    for (size_t i = 0; i < sizeof of_code / sizeof of_code[0]; i++)
        if (strcmp(of_code[i].code, code) == 0) return &of_code[i];
    for (size_t i = 0; i < STATUS_COUNT; i++)
        if (strcmp(of_status[i].code, code) == 0) return &of_status[i];
    return &of_status[STATUS_INTERNAL];
}
