/* The result of an earlier job, in a job that shows parameters without a fit (option fit.result_file): its rows with
 * measured and rendered radiances, and its smooth factor. */
#ifndef SELVEDGE_OPTIMIZER_GIVEN_RESULT_H
#define SELVEDGE_OPTIMIZER_GIVEN_RESULT_H

#include "optimizer/stages/job_inputs.h"

/* Fills in->rows.observation and in->given from the file that the document names; nothing happens without one.
 * STATUS_FORMAT, STATUS_INVALID with err->field OPTION_RESULT_FILE and the number of the row at fault; errors of
 * foreign_json_read. */
status given_result_read(const struct stage_tools *tools, struct job_inputs *in, struct error *err);
void given_result_release(struct given_result *given);

#endif
