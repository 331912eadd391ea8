#include "optimizer/fit/linear/linear_model.h"
#include "optimizer/fit/objective/objective.h"

#include <stdlib.h>
#include <string.h>

void linear_history_init(struct linear_history *h, const struct observation_set *o, const struct coordinate *k,
                         size_t n_param)
{
    *h = (struct linear_history){.observation = o, .coordinate = k, .n_param = n_param};
}

void linear_history_release(struct linear_history *h)
{
    for (size_t i = 0; i < h->n_step; i++) {
        free(h->step[i].replica[0]);
        free(h->step[i].replica[1]);
    }
    free(h->step);
    h->step = NULL;
    h->n_step = h->capacity = 0;
}

status linear_history_append(struct linear_history *h, const double *x, const struct estimate *a,
                             const struct estimate *b, struct error *err)
{
    if (h->n_step == h->capacity) {
        size_t capacity = h->capacity > 0 ? 2 * h->capacity : 32;
        struct history_step *grown = realloc(h->step, capacity * sizeof *grown);
        if (grown == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot keep the estimates of a fit: out of memory");
        h->step = grown;
        h->capacity = capacity;
    }
    struct history_step *s = &h->step[h->n_step];
    size_t n = h->observation->n;
    s->replica[0] = malloc(n * sizeof *a);
    s->replica[1] = malloc(n * sizeof *b);
    if (s->replica[0] == NULL || s->replica[1] == NULL) {
        free(s->replica[0]);
        free(s->replica[1]);
        return error_set(err, STATUS_NO_MEMORY, "cannot keep the estimates of a fit: out of memory");
    }
    memcpy(s->x, x, h->n_param * sizeof *x);
    for (size_t p = 0; p < h->n_param; p++)
        s->slope[p] = coordinate_slope(&h->coordinate[p], coordinate_to_param(&h->coordinate[p], x[p]));
    memcpy(s->replica[0], a, n * sizeof *a);
    memcpy(s->replica[1], b, n * sizeof *b);
    h->n_step++;
    return STATUS_OK;
}

double linear_history_path_variance(const struct linear_history *h, size_t i)
{
    double sum = 0.0, n = 0.0;
    for (size_t k = 0; k < h->n_step; k++) {
        for (int q = 0; q < 2; q++) {
            const struct estimate *e = &h->step[k].replica[q][i];
            if (e->n_path == 0) continue;
            double paths = (double)e->n_path;
            /* weighted by paths, because var is itself an estimate that improves with them */
            sum += paths * paths * (e->var[0] + e->var[1] + e->var[2]) / 3.0;
            n += paths;
        }
    }
    return n > 0.0 ? objective_weight(&h->observation->item[i]) * sum / n : 0.0;
}
