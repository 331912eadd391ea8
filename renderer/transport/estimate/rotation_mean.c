#include "renderer/transport/estimate/rotation_mean.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t rotations(const struct configuration *c) { return c->n_rotation > 1 ? c->n_rotation : 1; }

bool rotation_mean_wanted(const struct configuration *c, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (c[i].n_rotation > 1) return true;
    return false;
}

status rotation_mean_init(struct rotation_mean *m, const struct configuration *c, const size_t *n_path, size_t n,
                          struct error *err)
{
    *m = (struct rotation_mean){.n = n};
    for (size_t i = 0; i < n; i++) {
        m->n_turned += rotations(&c[i]);
        if (rotations(&c[i]) > 1 && c[i].contrast_cells > 0)
            return error_set_field(err, STATUS_INVALID, "configuration",
                                   "cannot estimate the contrast of configuration %zu: it is a mean over rotations", i);
    }
    m->turned = calloc(m->n_turned + 1, sizeof *m->turned);
    m->n_path = calloc(m->n_turned + 1, sizeof *m->n_path);
    m->first = calloc(n + 1, sizeof *m->first);
    m->estimate = calloc(m->n_turned + 1, sizeof *m->estimate);
    if (m->turned == NULL || m->n_path == NULL || m->first == NULL || m->estimate == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    for (size_t i = 0, t = 0; i < n; i++) {
        size_t n_rotation = rotations(&c[i]);
        for (size_t k = 0; k < n_rotation; k++, t++) {
            m->turned[t] = c[i];
            m->turned[t].n_rotation = 0;
            m->turned[t].cloth_rotation_rad += 2 * M_PI * (double)k / (double)n_rotation;
            m->n_path[t] = (n_path[i] + n_rotation - 1) / n_rotation;
        }
        m->first[i + 1] = t;
    }
    return STATUS_OK;
}

/* sum <- sum + share * e, for means of independent estimates. */
static void add(struct estimate *sum, const struct estimate *e, double share)
{
    for (size_t c = 0; c < 3; c++) {
        sum->mean[c] += share * e->mean[c];
        sum->var[c] += share * share * e->var[c];
    }
    for (size_t k = 0; k < sizeof sum->jac / sizeof *sum->jac; k++) {
        sum->jac[k] += share * e->jac[k];
        sum->jac_var[k] += share * share * e->jac_var[k];
    }
    sum->n_path += e->n_path;
    sum->n_bounce += e->n_bounce;
}

void rotation_mean_take(const struct rotation_mean *m, struct estimate *out)
{
    memset(out, 0, m->n * sizeof *out);
    for (size_t i = 0; i < m->n; i++) {
        double share = 1.0 / (double)(m->first[i + 1] - m->first[i]);
        for (size_t t = m->first[i]; t < m->first[i + 1]; t++) add(&out[i], &m->estimate[t], share);
    }
}

void rotation_mean_release(struct rotation_mean *m)
{
    free(m->turned);
    free(m->n_path);
    free(m->first);
    free(m->estimate);
}
