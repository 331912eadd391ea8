/* Warnings about the inputs of a job that has ended with an error. */
#ifndef SELVEDGE_OPTIMIZER_OTHER_FAULTS_H
#define SELVEDGE_OPTIMIZER_OTHER_FAULTS_H

#include "optimizer/stages/run/stage_tools.h"

/* When the status s is one that inputs cause, warns of their other faults. Takes the folder of the inputs out of the
 * text of err, because users know their files by their names alone. Does nothing for STATUS_OK. */
void other_faults_name(const struct stage_tools *tools, status s, struct error *err);

#endif
