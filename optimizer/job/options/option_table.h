/* The table of job options: one row for each key of the job document. The rows drive the parser (option_reader.h), the
 * keys that are allowed, and GET /v1/options (option_json.h). From the latter follow the form of the dashboard, the
 * schema JobDocument of config/openapi.json and the page docs/options.md (`make generate`).
 *
 * A new option is a row here, a member of the struct of its section, and the place that uses it. Constant data.
 */
#ifndef SELVEDGE_OPTIMIZER_OPTION_TABLE_H
#define SELVEDGE_OPTIMIZER_OPTION_TABLE_H

#include "optimizer/job/options/option_row.h"

/* Row i in the order of the document; NULL after the last. */
const struct job_option *job_option_at(size_t i);
/* The rows of part i, up to one without a path; NULL: there is no such part. JOB_OPTION_EACH walks all rows of the
 * table without searching each from its beginning, as job_option_at does. */
const struct job_option *job_option_part(size_t i);
#define JOB_OPTION_EACH(row)                                                                                           \
    for (size_t i_part_ = 0; job_option_part(i_part_) != NULL; i_part_++)                                              \
        for (const struct job_option *row = job_option_part(i_part_); row->path != NULL; row++)
/* The row of a path of the table; NULL when there is none. */
const struct job_option *job_option_find(const char *path);
/* The key of a row inside its section: "side_cm" for the row "lamp.side_cm" in the section "lamp". The section "" is
 * the document, "photographs[]" an element of a list. NULL when the row does not stand directly in this section. */
const char *job_option_key_in(const struct job_option *row, const char *section);
/* Word i of a choice; NULL after the last. */
const char *job_option_choice(const struct job_option *row, size_t i);

#endif
