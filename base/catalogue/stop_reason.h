/* Why a fit ended, as a code that programs can test; the sentence for people stands beside it (fit_result.reason). */
#ifndef SELVEDGE_BASE_STOP_REASON_H
#define SELVEDGE_BASE_STOP_REASON_H

enum stop_reason {
    STOP_ARRIVED,
    STOP_ARRIVED_WITHIN_PHOTOGRAPHS,
    STOP_MISFIT,
    STOP_PATH_BUDGET,
    STOP_ITERATIONS,
    STOP_STEP_TAKEN_BACK,
    STOP_TOO_FEW_STEPS,
    STOP_SCHEDULE,
    STOP_STILL_MOVING,
    STOP_END_OF_BRACKET,
    STOP_DECREASE_LEFT,
    STOP_NOISE,
    STOP_N_REASON
};

/* id: "arrived", a word that never changes its meaning; meaning: one sentence. */
struct stop_reason_info {
    const char *id, *meaning;
};
const struct stop_reason_info *stop_reason_info(enum stop_reason reason);

#endif
