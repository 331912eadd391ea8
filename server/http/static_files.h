/* The static files of the server: the dashboard, the JavaScript libraries that it uses (from Debian packages) and
 * the description of the API. The table of addresses and files is made once at the start, and no other file is ever
 * served. */
#ifndef SELVEDGE_SERVER_STATIC_FILES_H
#define SELVEDGE_SERVER_STATIC_FILES_H

#include "base/log.h"
#include "base/status.h"

struct static_file {
    char url[256]; /* "/app.js" */
    char path[1024];
};

struct static_files;

/* web, openapi: paths from the settings; "" looks in the source tree or installation that the program belongs to. A
 * dashboard that is not found there gives a warning in the log; a configured web folder that cannot be read is an
 * error. STATUS_IO, STATUS_NOT_FOUND, STATUS_NO_MEMORY. */
status static_files_new(const char *web, const char *openapi, struct log *log, struct static_files **files,
                        struct error *err);
void static_files_free(struct static_files *files);
/* Returns NULL when the table has no such address. "/" is the dashboard's index.html. */
const struct static_file *static_files_find(const struct static_files *files, const char *url);

#endif
