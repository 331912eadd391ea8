#include "base/catalogue/volume_format.h"

#include <stddef.h>
#include <string.h>
#include <strings.h>

static const struct volume_format table[] = {
#define VOLUME_FORMAT(reader, shown, ...) {__VA_ARGS__},
#include "generated/volume_formats.def"
#undef VOLUME_FORMAT
};

/* begins with a separator, which the list leaves out */
static const char list_after_separator[] =
#define VOLUME_FORMAT(reader, shown, ...) ", " shown
#include "generated/volume_formats.def"
#undef VOLUME_FORMAT
    ;
const char *const volume_format_list = list_after_separator + 2;

static bool ends_with(const char *name, const char *ending)
{
    const size_t n = strlen(name), m = strlen(ending);
    return n >= m && strcasecmp(name + n - m, ending) == 0;
}

const struct volume_format *volume_format_of(const char *name)
{
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        for (int k = 0; k < VOLUME_MAX_ENDING && table[i].ending[k] != NULL; k++)
            if (ends_with(name, table[i].ending[k])) return &table[i];
    return NULL;
}

bool volume_format_is_header(const struct volume_format *format, const char *name)
{
    return format->header_ending != NULL && ends_with(name, format->header_ending);
}
