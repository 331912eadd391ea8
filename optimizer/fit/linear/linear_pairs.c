#include "optimizer/fit/linear/linear_pairs.h"

/* Adds the partners of configuration i in one estimate to the pairs that begin at `first`. */
static void add_partners(struct linear_model *m, size_t first, size_t i, const struct estimate *e)
{
    for (uint32_t k = 0; k < e->n_partner; k++) {
        size_t p = first;
        while (p < m->n_pair && m->pair[p].j != e->partner[k].configuration) p++;
        if (p == first + ESTIMATE_MAX_PARTNER) continue; /* cannot happen: all estimates have the same partners */
        if (p == m->n_pair) m->pair[m->n_pair++] = (struct linear_pair){i, e->partner[k].configuration, 0.0};
        m->pair[p].correlation += (double)e->n_path * (double)e->partner[k].correlation;
    }
}

void linear_pairs_pool(struct linear_model *m, const struct linear_history *h)
{
    m->n_pair = 0;
    for (size_t i = 0; i < h->observation->n; i++) {
        const size_t first = m->n_pair;
        double n_path = 0.0;
        for (size_t k = 0; k < h->n_step; k++) {
            for (int q = 0; q < 2; q++) {
                const struct estimate *e = &h->step[k].replica[q][i];
                n_path += (double)e->n_path;
                add_partners(m, first, i, e);
            }
        }
        for (size_t p = first; p < m->n_pair; p++) m->pair[p].correlation /= n_path;
    }
}
