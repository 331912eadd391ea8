/* The dashboard, the JavaScript libraries that it uses (from Debian packages) and the API's description: a table of addresses and
 * files made once at the start. Nothing else is ever served, whatever a request asks for. */
#ifndef SELVEDGE_SERVER_STATIC_FILES_H
#define SELVEDGE_SERVER_STATIC_FILES_H

#include "base/log.h"
#include "base/status.h"

struct static_file {
    char url[256]; /* "/app.js" */
    char path[1024];
};

struct static_files;

/* web, openapi: from the settings, or "" to look beside the program (source tree or installed). A dashboard that is not there is
 * a warning in the log; a web folder that was asked for and is not there is an error. */
status static_files_new(const char *web, const char *openapi, struct log *log, struct static_files **files,
                        struct error *err);
void static_files_free(struct static_files *files);
/* NULL when the table has no such address. "/" is the dashboard's index.html. */
const struct static_file *static_files_find(const struct static_files *files, const char *url);

#endif
