/* The table of a batch: a template, which is a job document, and a row for each sample, which replaces members of it
 * and names the sample's files. Reading it makes a whole job document of each row and changes nothing. */
#ifndef SELVEDGE_SERVER_BATCH_TABLE_H
#define SELVEDGE_SERVER_BATCH_TABLE_H

#include "server/jobs/job_service.h"

/* All documents of a batch together have BATCH_TEXT_MOST_BYTES at most. */
enum { BATCH_SAMPLE_MOST = 10000, BATCH_TEXT_MOST_BYTES = 64 << 20 };

struct batch_sample {
    char sample[256];
    char *document;        /* JSON text, owned */
    struct file_row *file; /* owned; name, role, size and SHA-256 of each, sorted by name */
    size_t n_file;
};

struct batch_table {
    char name[STORE_NAME_BYTES];
    char *template_text; /* owned */
    bool update;         /* a batch of this name may be there, and is to become like this table */
    struct batch_sample *sample;
    size_t n;
};

/* Reads the body of a request, {"name","template","samples":[{"sample","replace","files"}...],"update"}.
 * STATUS_INVALID, and then *faults (a new reference) is a list of {"code","field","detail"} with the first fault of
 * each row; STATUS_NO_MEMORY. The caller releases the table, after an error too. */
status batch_table_read(struct job_service *v, const json_t *body, struct batch_table *table, json_t **faults,
                        struct error *err);
void batch_table_release(struct batch_table *table);

#endif
