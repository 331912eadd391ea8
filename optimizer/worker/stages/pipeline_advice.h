/* What is said about a result beyond its numbers: whether its derivatives can be trusted (gradient certificate), and which photograph would tell most. Done
 * at the beginning of the stage "report", for every model. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_ADVICE_H
#define SELVEDGE_OPTIMIZER_PIPELINE_ADVICE_H

#include "optimizer/worker/pipeline_context.h"

/* Fills in the certificate of every model, and warns of one that fails. Some seconds at most. */
status pipeline_certify(struct pipeline_context *c, struct error *err);

/* Ranks the candidates of the document for every model. Nothing when there are none. */
status pipeline_rank_candidates(struct pipeline_context *c, struct error *err);

#endif
