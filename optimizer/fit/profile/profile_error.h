/* Inside profile/: the parameters and their standard errors at the end of a search (profile_fit.h). */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_ERROR_H
#define SELVEDGE_OPTIMIZER_PROFILE_ERROR_H

#include "optimizer/fit/profile/profile_search.h"

/* Fills in param, se_param, at_bound, determined, scale and scale_se. */
void profile_error_put(const struct profile_search *s, struct profile_fit *fit);

#endif
