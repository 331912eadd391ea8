#include "renderer/estimate/rotation_mean.h"

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
    m->row = calloc(m->n_turned + 1, sizeof *m->row);
    m->estimate = calloc(m->n_turned + 1, sizeof *m->estimate);
    if (m->turned == NULL || m->n_path == NULL || m->first == NULL || m->row == NULL || m->estimate == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    for (size_t i = 0, t = 0; i < n; i++) {
        size_t n_rotation = rotations(&c[i]);
        for (size_t k = 0; k < n_rotation; k++, t++) {
            m->turned[t] = c[i];
            m->turned[t].n_rotation = 0;
            m->turned[t].cloth_rotation_rad += 2 * M_PI * (double)k / (double)n_rotation;
            m->n_path[t] = (n_path[i] + n_rotation - 1) / n_rotation;
            m->row[t] = i;
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

static double common_scale(const struct estimate *a, const struct estimate *b)
{
    double sum = 0.0;
    for (size_t c = 0; c < 3; c++) sum += sqrt(a->var[c] * b->var[c]);
    return sum;
}

/* Finds the entry of a partner, or adds one. NULL when there is no room. */
static struct estimate_partner *entry_of(struct estimate *e, size_t configuration)
{
    uint32_t k = 0;
    while (k < e->n_partner && e->partner[k].configuration != configuration) k++;
    if (k == ESTIMATE_MAX_PARTNER) return NULL;
    if (k == e->n_partner) e->partner[e->n_partner++] = (struct estimate_partner){(uint32_t)configuration, 0.0f};
    return &e->partner[k];
}

/* Adds the correlations that mean i has through rotation t, which shared its paths with rotations of other rows. */
static void add_partners(const struct rotation_mean *m, size_t i, size_t t, struct estimate *out)
{
    const struct estimate *e = &m->estimate[t];
    for (uint32_t k = 0; k < e->n_partner; k++) {
        const size_t turned = e->partner[k].configuration, row = m->row[turned];
        const double n = (double)(m->first[i + 1] - m->first[i]), n_row = (double)(m->first[row + 1] - m->first[row]);
        const double scale = common_scale(&out[i], &out[row]) * n * n_row;
        struct estimate_partner *to = entry_of(&out[i], row);
        if (to == NULL || !(scale > 0.0)) continue;
        to->correlation += (float)(e->partner[k].correlation * common_scale(e, &m->estimate[turned]) / scale);
    }
}

void rotation_mean_take(const struct rotation_mean *m, struct estimate *out)
{
    memset(out, 0, m->n * sizeof *out);
    for (size_t i = 0; i < m->n; i++) {
        double share = 1.0 / (double)(m->first[i + 1] - m->first[i]);
        for (size_t t = m->first[i]; t < m->first[i + 1]; t++) add(&out[i], &m->estimate[t], share);
        for (size_t t = m->first[i]; t < m->first[i + 1]; t++) add_partners(m, i, t, out);
    }
}

void rotation_mean_release(struct rotation_mean *m)
{
    free(m->turned);
    free(m->n_path);
    free(m->first);
    free(m->row);
    free(m->estimate);
}
