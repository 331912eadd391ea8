/* The formats of scans by the endings of file names (rows VOLUME_FORMAT of geometry/volume/format). */
#ifndef SELVEDGE_BASE_VOLUME_FORMAT_H
#define SELVEDGE_BASE_VOLUME_FORMAT_H

#include <stdbool.h>

enum { VOLUME_MAX_ENDING = 4, VOLUME_MAX_KEY = 2 };

struct volume_format {
    const char *ending[VOLUME_MAX_ENDING]; /* in lower case; NULL after the last one */
    bool may_be_slices;                    /* a scan may be a folder of such files, one slice each */
    bool orders_itself;                    /* its slices state their order, so their names do not */
    /* A file with this ending is a header that names its data file: a line with one of the keys, the separator and the
     * name, or LOCAL. NULL: the format has no such headers. */
    const char *header_ending;
    char separator;
    const char *data_key[VOLUME_MAX_KEY];
    const char *data_ending; /* the data file has the name of the header but for this ending; NULL: a line names it */
};

/* "TIFF, .mhd, .mha, ...": all formats, for messages and help. */
extern const char *const volume_format_list;

/* Returns the format by the ending of a file's name, whatever its case, or NULL. */
const struct volume_format *volume_format_of(const char *name);
/* Whether the file is a header whose data is in another file. */
bool volume_format_is_header(const struct volume_format *format, const char *name);

#endif
