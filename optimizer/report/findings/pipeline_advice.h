/* Two additions to the result of every model, made at the beginning of the stage "report": whether its derivatives
 * can be trusted (gradient certificate), and which photograph would improve it most. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_ADVICE_H
#define SELVEDGE_OPTIMIZER_PIPELINE_ADVICE_H

#include "optimizer/report/findings/report.h"

/* Fills in the certificate of every model and warns if one fails. Takes some seconds at most. */
status pipeline_certify(struct report *report, struct error *err);
/* Returns whether the derivatives are as good as they must be; noise alone is no reason to fail. */
bool pipeline_certificate_passed(const struct pipeline_model *m);

/* Ranks the candidate photographs of the document for every model. Without candidates it does nothing. */
status pipeline_rank_candidates(struct report *report, struct error *err);

#endif
