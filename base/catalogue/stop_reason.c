#include "base/catalogue/stop_reason.h"

static const struct stop_reason_info table[STOP_N_REASON] = {
    [STOP_ARRIVED] = {"arrived", "Further steps would gain too little, and the noise of tracing is small."},
    [STOP_ARRIVED_WITHIN_PHOTOGRAPHS] =
        {"arrived_within_photographs",
         "Further steps would gain too little, and tracing adds less to the errors than the photographs' own noise."},
    [STOP_MISFIT] = {"misfit",
                     "What is left is a difference between model and measurements that more paths do not lower."},
    [STOP_PATH_BUDGET] = {"path_budget", "The path budget was used up."},
    [STOP_ITERATIONS] = {"iterations", "The iterations were used up."},
    [STOP_STEP_TAKEN_BACK] = {"step_taken_back",
                              "Paths or iterations were used up after a step that made the objective worse."},
    [STOP_TOO_FEW_STEPS] = {"too_few_steps", "There were too few steps to tell whether the fit has converged."},
    [STOP_SCHEDULE] =
        {"schedule",
         "The method's schedule is complete, the best run had come to rest, and no lower objective is near."},
    [STOP_STILL_MOVING] = {"still_moving",
                           "The method's schedule is complete, and the best run still moved in one direction."},
    [STOP_END_OF_BRACKET] = {"end_of_bracket",
                             "The best run had the smallest or the largest of the step sizes that the method tries."},
    [STOP_DECREASE_LEFT] = {"decrease_left",
                            "The method's schedule is complete, but further steps promise to lower the "
                            "objective."},
    [STOP_NOISE] = {"noise", "The method's schedule is complete, but the noise of tracing is too large to tell whether "
                             "the fit has converged."},
};

const struct stop_reason_info *stop_reason_info(enum stop_reason reason) { return &table[reason]; }
