/* The skill of a fit: its error over held-out rows beside the error of a plain BRDF fitted to the same rows
 * (plain_brdf.h). */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_SKILL_H
#define SELVEDGE_OPTIMIZER_PIPELINE_SKILL_H

#include "optimizer/report/findings/report.h"

/* Fills in report->skill, and adds a warning when the plain BRDF predicts the held-out rows better than the best
 * model by more than the noise of its rendered rows. Not measured where a row has an environment. After validation;
 * takes milliseconds. STATUS_NO_MEMORY. */
status pipeline_measure_skill(struct report *report, struct error *err);

#endif
