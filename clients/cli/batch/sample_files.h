/* The files of a sample folder: their names and a fingerprint by which a later look notices every change, and the job
 * document, which is the folder's own or made of a template. */
#ifndef SELVEDGE_CLIENTS_SAMPLE_FILES_H
#define SELVEDGE_CLIENTS_SAMPLE_FILES_H

#include "base/status.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#define SAMPLE_DOCUMENT "job.json"
enum { SAMPLE_FINGERPRINT_BYTES = 65 };

struct sample_files {
    char **name; /* of the regular files, sorted; the marker is not among them */
    size_t n;
    bool marked;                                /* the marker is there */
    char fingerprint[SAMPLE_FINGERPRINT_BYTES]; /* of names, sizes and times of change; "" when there is no file */
};

/* Lists the folder. marker: name of the file that says that the sample is complete. Links and folders in it are left
 * out; other hidden files too. STATUS_NOT_FOUND, STATUS_IO, STATUS_NO_MEMORY. */
status sample_files_list(const char *folder, const char *marker, struct sample_files *files, struct error *err);
void sample_files_release(struct sample_files *files);
bool sample_files_have(const struct sample_files *files, const char *name);

/* The job document of a sample: job.json of the folder, or else the template (NULL: none) with the sample's name, where
 * each text with a '*' but the name stands for the files that it matches: in a list for all of them, in the order of
 * their names; elsewhere for exactly one. Checks that all files that the document names are there. The caller owns
 * *document. STATUS_NOT_FOUND (no document; a file is missing), STATUS_INVALID, STATUS_IO. */
status sample_document(const char *folder, const char *name, const struct sample_files *files, const json_t *template,
                       json_t **document, struct error *err);

#endif
