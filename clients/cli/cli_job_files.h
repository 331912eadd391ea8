/* The input files that a job document names, and their SHA-256 and size. */
#ifndef SELVEDGE_CLIENTS_CLI_JOB_FILES_H
#define SELVEDGE_CLIENTS_CLI_JOB_FILES_H

#include "base/status.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

enum { CLI_SHA256_HEX = 65 };

struct cli_file {
    char *name;       /* as the document says, without a folder */
    char *path;       /* on this machine */
    const char *role; /* "volume", "fibers", "measurements", "photograph" */
    uint64_t n_bytes;
    char sha256[CLI_SHA256_HEX];
};

struct cli_file_list {
    struct cli_file *file;
    size_t n_file;
};

/* Every file of the document, each name once, in the document's order; folder is put before the names. Looks at nothing but the
 * document: the server judges it. STATUS_INVALID for a name with a '/' (inputs lie flat in one folder) or a field that is not a string. */
status cli_job_files_list(const json_t *document, const char *folder, struct cli_file_list *list, struct error *err);
void cli_job_files_release(struct cli_file_list *list);

/* Size and SHA-256 of one file. changed() is called with bytes read so far (NULL allowed); it returns false to stop: STATUS_CANCELLED.
 * STATUS_NOT_FOUND, STATUS_IO naming the path. */
status cli_file_hash(struct cli_file *file, bool (*changed)(void *context, uint64_t n_done), void *context,
                     struct error *err);

#endif
