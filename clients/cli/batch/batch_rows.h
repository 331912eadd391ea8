/* The rows of a batch, from a table or from a folder of samples. */
#ifndef SELVEDGE_CLIENTS_BATCH_ROWS_H
#define SELVEDGE_CLIENTS_BATCH_ROWS_H

#include "base/status.h"
#include "clients/cli/commands/cli_job_files.h"

#include <jansson.h>

/* A sample on this machine. */
struct batch_row {
    char *sample;              /* its name */
    json_t *replace;           /* {"/member": value}: members of its document that replace the template's */
    struct cli_file_list list; /* its files; sizes and checksums are not known yet */
};

struct batch_rows {
    struct batch_row *row;
    size_t n;
};

/* Reads a CSV file whose first line names the columns: "sample", and paths of members of the template
 * (base/files/document_path.h). An empty cell leaves the template's value; a cell that is JSON is that value, and any
 * other is a text. files: the folder of the input files; a sample that has a folder of its own in it has its files
 * there, and then a '*' of the template stands for them. STATUS_INVALID and STATUS_NOT_FOUND name line and column, or
 * the sample. */
status batch_rows_of_table(const char *path, const char *files, const json_t *template_, struct batch_rows *rows,
                           struct error *err);
/* Makes a sample of every folder in a folder, in the order of their names. A '*' of the template stands for its
 * files. */
status batch_rows_of_folder(const char *folder, const json_t *template_, struct batch_rows *rows, struct error *err);
/* Releases rows, also after an error. */
void batch_rows_release(struct batch_rows *rows);

#endif
