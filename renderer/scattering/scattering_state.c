#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>

status scattering_state_new(const struct scattering_model *m, const double *param, scattering_fill fill, size_t bytes,
                            struct thread_pool *pool, struct scattering_state **state, struct error *err)
{
    status st = param_check(m->param, m->n_param, m->id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = calloc(1, bytes);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    st = fill(s, param, pool, err);
    if (st == STATUS_OK)
        *state = s;
    else
        free(s);
    return st;
}
