/* Rows of the option table: the profile of a single fiber. */
#include "optimizer/job/options/option_rows.h"

const struct job_option option_rows_profile[] = {
    {.path = "profile",
     .kind = OPTION_SECTION,
     .left_out = "this, or a cloth with `photographs` or `measurements`",
     .meaning = "The measured profile of a single fiber, to which the models of `fit` are fitted. Such a job has no "
                "cloth: besides this section it takes `sample` and `fit`, and of the latter `model`, `models`, `seed`, "
                "`fixed`, `start`, `tied`, `bounds`, `priors`, `starts` and `max_iterations`. Its result can be the "
                "prior of a cloth of such fibers (`fit.profile_job`)."},
    {.path = "profile.file",
     .kind = OPTION_FILE_NAME,
     .id = OPTION_PROFILE_FILE,
     INTO(profile_file),
     .required = true,
     .allowed = "CSV, section 3",
     .meaning = "The table of a goniometer, with the columns `theta_o_deg`, `phi_deg` and `radiance`. Upload it with "
                "the role `profile`."},
    {.path = "profile.theta_i_deg",
     .kind = OPTION_NUMBER,
     INTO(profile_theta_i_deg),
     RANGE(-89.9, 89.9),
     .unit = "degrees",
     .left_out = "the column `theta_i_deg`",
     .meaning = "Angle of the light from the normal plane of the fiber, where all rows have the same."},
    {.path = "profile.scale",
     .kind = OPTION_NUMBER,
     INTO(profile_scale),
     RANGE(1e-12, 1e12),
     .left_out = "fitted",
     .meaning = "The value of the file that stands for a radiance of 1 where the irradiance across the light's "
                "direction is 1. Leave it out for relative values: what the fiber absorbs is then seen in the shape of "
                "the profile alone."},
    {.path = NULL},
};
