/* Warnings about the inputs of a job that has ended with an error. */
#ifndef SELVEDGE_OPTIMIZER_OTHER_FAULTS_H
#define SELVEDGE_OPTIMIZER_OTHER_FAULTS_H

#include "optimizer/stages/run/stage_tools.h"

/* If inputs can cause the status s, checks all inputs and warns about every further fault. Removes the path of the
 * input folder from err->text, because users know their files by name only. Does nothing for STATUS_OK. */
void other_faults_name(const struct stage_tools *tools, status s, struct error *err);

#endif
