/* Lists the input files that a job document names, and computes their size and SHA-256. */
#ifndef SELVEDGE_CLIENTS_CLI_JOB_FILES_H
#define SELVEDGE_CLIENTS_CLI_JOB_FILES_H

#include "base/status.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { CLI_SHA256_HEX = 65 };

struct cli_file {
    char *name;       /* as in the document, without a folder */
    char *path;       /* its path on this machine */
    const char *role; /* "volume", "fibers", "environment", "measurements", "photograph" */
    bool no_links;    /* whoever can write to the folder may not have other files sent */
    uint64_t n_bytes;
    char sha256[CLI_SHA256_HEX];
};

struct cli_file_list {
    struct cli_file *file;
    size_t n_file;
};

/* Lists each file of the document once, in the order of the document; its path is folder/name. Checks only file
 * names, because the server checks the document. STATUS_INVALID for a name with a '/' (all inputs lie in one folder)
 * or a field that is not a string, STATUS_NO_MEMORY. */
status cli_job_files_list(const json_t *document, const char *folder, struct cli_file_list *list, struct error *err);
/* The same, but neither the folder nor a file in it may be a link when a file is opened. */
status cli_job_files_list_strict(const json_t *document, const char *folder, struct cli_file_list *list,
                                 struct error *err);
/* Opens a file for reading. Returns -1 with errno; ELOOP or ENOTDIR: it or its folder is a link that is not allowed. */
int cli_file_open(const struct cli_file *file);
/* Prints the order in which the files of a scan are taken, if there are several. */
void cli_job_files_note(const json_t *document, FILE *note);
void cli_job_files_release(struct cli_file_list *list);

/* Computes size and SHA-256 of one file. changed() is called with the bytes read so far (may be NULL); if it returns
 * false, the call ends with STATUS_CANCELLED. STATUS_NOT_FOUND and STATUS_IO name the path. */
status cli_file_hash(struct cli_file *file, bool (*changed)(void *context, uint64_t n_done), void *context,
                     struct error *err);

#endif
