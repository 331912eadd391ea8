/* The verdict on the job's result (optimizer/report/findings/verdict.h) from the outputs of the stages. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_VERDICT_H
#define SELVEDGE_OPTIMIZER_PIPELINE_VERDICT_H

#include "optimizer/report/findings/report.h"

/* Fills in report->verdict, of the best model or, without a fit, of the geometry, and puts it into the status, from
 * which the daemon's list of jobs has it. In the stage "report", after the certificate and the skill. */
void pipeline_reach_verdict(struct report *report);

#endif
