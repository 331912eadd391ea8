/* The parameters of a model in a cloth of several groups of fibers: one set for each group, one set after the other.
 *
 * The name of a parameter begins with the name of its set: "warp.C_R.r", symbol "warp.C_R". A cloth of one group has
 * one set, and its parameters have the names of the model. A volume model sees no fibers, so it has one set in any
 * cloth. */
#ifndef SELVEDGE_BASE_MODEL_SETS_H
#define SELVEDGE_BASE_MODEL_SETS_H

#include "base/catalogue/model_catalogue.h"

enum { MODEL_SET_NAME_BYTES = 24, MODEL_SET_TEXT_BYTES = 64 };

struct model_sets {
    size_t n_set; /* at least 1 */
    size_t n_own; /* parameters of one set */
    /* The parameters of all sets: id, title and kind of the model, n_param = n_set * n_own. Points into this struct,
     * which must not be moved, and to the names of the sets, which are the caller's. */
    struct model_info info;
    struct param_info param[MODEL_MAX_FLAT];
    char name[MODEL_MAX_FLAT][MODEL_SET_TEXT_BYTES], symbol[MODEL_MAX_FLAT][MODEL_SET_TEXT_BYTES];
};

/* set: names of the n_set groups; n_set 0 or 1: one group, its name is not used. STATUS_INVALID for more sets or
 * parameters than MODEL_MAX_SET and MODEL_MAX_FLAT. */
status model_sets_init(struct model_sets *sets, const struct model_info *model, const char (*set)[MODEL_SET_NAME_BYTES],
                       size_t n_set, struct error *err);

#endif
