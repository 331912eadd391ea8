#include "optimizer/job/document/job_file_name.h"
#include "base/utf8.h"

#include <stdio.h>
#include <string.h>

/* Characters of names that results get. */
static const char name_plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";

/* Whether a character, of n bytes, would do harm in a path, on a terminal or in a log. */
static bool is_harmful(const char *c, size_t n)
{
    const unsigned char first = (unsigned char)c[0];
    const bool control = first < 0x20 || first == 0x7f || (n == 2 && first == 0xc2 && (unsigned char)c[1] < 0xa0);
    return control || first == '/' || first == '\\';
}

bool job_file_name_valid(const char *name)
{
    const size_t n_name = strlen(name);
    if (n_name == 0 || n_name >= JOB_MAX_NAME_BYTES || name[0] == '.') return false;
    for (size_t n; *name != '\0'; name += n) {
        n = utf8_sequence_bytes(name);
        if (n == 0 || is_harmful(name, n)) return false;
    }
    return true;
}

void job_file_name_make_valid(const char *text, char name[JOB_MAX_NAME_BYTES])
{
    snprintf(name, JOB_MAX_NAME_BYTES, "%s", text);
    if (name[0] == '.' || name[0] == '\0') snprintf(name, JOB_MAX_NAME_BYTES, "_%s", text[0] != '\0' ? text + 1 : "");
    for (char *p = name + strspn(name, name_plain); *p != '\0'; p += strspn(p, name_plain)) *p = '_';
}

status job_check_file_name(const char *path, const char *name, struct error *err)
{
    if (job_file_name_valid(name)) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, path,
                           "'%s' is '%.140s': a file name has 1 to %d bytes of UTF-8 without '/', '\\' and control "
                           "characters, and does not "
                           "start with a dot",
                           path, name, JOB_MAX_NAME_BYTES - 1);
}
