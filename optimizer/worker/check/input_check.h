/* The checks of a job's input files, and the record that they share. A check does nothing where its files are missing,
 * which is a fault already, and goes on after a fault. */
#ifndef SELVEDGE_OPTIMIZER_INPUT_CHECK_H
#define SELVEDGE_OPTIMIZER_INPUT_CHECK_H

#include "optimizer/job/checks/job_faults.h"
#include "optimizer/job/document/job_sections.h"

#include <stdbool.h>

enum { INPUT_PATH_BYTES = 4096 };

struct input_check {
    const char *folder;
    struct job_sections section; /* wrong values in it are replaced by defaults */
    struct job_setup *setup;     /* two of the sections, which the rig of a camera completes */
    struct job_rows *rows;
    struct job_fault_list *fault;
    json_t *warnings; /* [{"field", "detail"}] */
    json_t *files;    /* ledgers (base/files/file_ledger_json.h) */
    size_t n_file;
};

/* Adds a fault, with the id of an option in its field replaced by the option's key. */
void input_check_fault(struct input_check *c, const struct error *fault);
/* A receiver of warnings (base/warning.h); context: the check. */
void input_check_warn(void *context, const char *option, const char *text);
bool input_check_has(const struct input_check *c, const char *name);
void input_check_path(const struct input_check *c, const char *name, char path[INPUT_PATH_BYTES]);

/* The scan, the fiber file, the image of the surroundings, the photograph of the weave. */
void input_check_cloth(struct input_check *c);
/* Every photograph, or every line of the table; then all rows together. */
void input_check_rows(struct input_check *c);
/* The meshes that pictures of the fitted cloth lie on. */
void input_check_pictures(struct input_check *c);

#endif
