#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/fit/descent/descent.h"
#include "optimizer/job/document/job_fit_option.h"

#include <math.h>

_Static_assert((int)JOB_MAX_PARAM == (int)FIT_MAX_PARAM && (int)JOB_MAX_START == (int)FIT_MAX_START,
               "a document's limits are those of the fit");

void pipeline_fit_option(const struct job_fit_option *from, const struct param_info *info, size_t n_param,
                         struct fit_option *to)
{
    fit_option_init(to);
    for (size_t p = 0; p < n_param; p++) {
        to->leader[p] = from->leader[p];
        to->ratio[p] = from->ratio[p];
        if (isnan(from->prior_mean[p])) continue;
        double mean = param_from_file_unit(&info[p], from->prior_mean[p]);
        to->prior_mean[p] = fmin(fmax(mean, info[p].lower), info[p].upper);
        to->prior_se[p] = param_from_file_unit(&info[p], from->prior_se[p]);
    }
    to->n_start = from->n_start;
    if (from->gain == JOB_GAIN_GLOBAL) to->global_gain_sd = from->gain_prior_rel;
    if (from->gain == JOB_GAIN_PER_PHOTOGRAPH) to->photograph_gain_sd = from->gain_prior_rel;
    if (from->stray_light) to->stray_light_sd = from->stray_light_prior;
}
