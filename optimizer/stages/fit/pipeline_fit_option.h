/* Converts the fit options of the job document (file units) to options of the optimizer (internal units). */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_FIT_OPTION_H
#define SELVEDGE_OPTIMIZER_PIPELINE_FIT_OPTION_H

#include "optimizer/fit/linear/fit_layout.h"

struct job_fit_option;

void pipeline_fit_option(const struct job_fit_option *from, const struct param_info *info, size_t n_param,
                         struct fit_option *to);

#endif
