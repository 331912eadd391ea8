/* The findings of the stage "report", in the order in which it makes them: gradient certificate and next photograph of
 * every model, skill, order of the photographs, verdict. They need the outputs of "validation". */
#ifndef SELVEDGE_OPTIMIZER_FINDINGS_H
#define SELVEDGE_OPTIMIZER_FINDINGS_H

#include "optimizer/report/findings/report.h"

/* ---- whether derivatives can be trusted, and the photograph that would improve the result most ---- */

/* Fills in the certificate of every model and warns if one fails. Takes some seconds at most. */
status pipeline_certify(struct report *report, struct error *err);
/* Returns whether the derivatives are as good as they must be; noise alone is no reason to fail. */
bool pipeline_certificate_passed(const struct pipeline_model *m);

/* Ranks the candidate photographs of the document for every model. Without candidates it does nothing. */
status pipeline_rank_candidates(struct report *report, struct error *err);

/* ---- skill: the error over held-out rows beside the error of a plain BRDF (plain_brdf.h) ---- */

/* Fills in report->skill, and adds a warning when the plain BRDF predicts the held-out rows better than the best
 * model by more than the noise of its rendered rows. Not measured where a row has an environment. After validation;
 * takes milliseconds. STATUS_NO_MEMORY. */
status pipeline_measure_skill(struct report *report, struct error *err);

/* ---- rows in another order of the cloth's rotation than the job states ---- */

/* Tries other orders of the cloth's rotations: reversed, and shifted by one forwards or backwards, for every lamp and
 * camera. Warns when the measurements in another order agree with the renderings of the best model much better than in
 * the stated order. After validation. STATUS_NO_MEMORY. */
status pipeline_warn_pairing(struct report *report, struct error *err);

/* ---- verdict (verdict.h) ---- */

/* Fills in report->verdict, of the best model or, without a fit, of the geometry, and puts it into the status, from
 * which the daemon's list of jobs has it. In the stage "report", after the certificate and the skill. */
void pipeline_reach_verdict(struct report *report);

#endif
