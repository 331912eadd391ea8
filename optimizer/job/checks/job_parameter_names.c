/* The names of a model's parameters in a job document. */
#include "optimizer/job/checks/job_document_parts.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

size_t job_n_named_parameter(const struct model_info *m) { return m->n_param - (m->kind == MODEL_VOLUME ? 1 : 0); }

size_t job_parameter_slots(const struct model_info *m, size_t n_param, const char *key, size_t *slot)
{
    size_t n = 0;
    for (size_t p = 0; p < n_param; p++)
        if (param_is_named(&m->param[p], key)) slot[n++] = p;
    return n;
}

/* Writes "C_R, beta_R, ...", and ", or weft.C_R ..." for each set after the first. A colour with three channels stands
 * in the list once. */
static void list_symbols(const struct model_info *m, char *text, size_t n_bytes)
{
    size_t used = 0;
    text[0] = '\0';
    for (size_t p = 0; p < job_n_named_parameter(m) && used < n_bytes; p++) {
        const char *symbol = param_own_symbol(&m->param[p]);
        bool first_set = m->param[p].set == m->param[0].set;
        if (first_set && p > 0 && strcmp(symbol, param_own_symbol(&m->param[p - 1])) == 0) continue;
        if (!first_set && m->param[p].set == m->param[p - 1].set) continue;
        int n = first_set ? snprintf(text + used, n_bytes - used, "%s%s", p > 0 ? ", " : "", symbol)
                          : snprintf(text + used, n_bytes - used, ", or %s.%s ...", m->param[p].set, symbol);
        if (n < 0) return;
        used += (size_t)n;
    }
}

status job_unknown_parameter(const struct model_info *const *model, size_t n_model, const char *path, const char *key,
                             struct error *err)
{
    char list[300], text[1000];
    size_t used = 0;
    text[0] = '\0';
    for (size_t i = 0; i < n_model && used < sizeof text; i++) {
        list_symbols(model[i], list, sizeof list);
        int n = snprintf(text + used, sizeof text - used, "%s model '%s' has %s", i > 0 ? ";" : "", model[i]->id, list);
        used += n > 0 ? (size_t)n : 0;
    }
    return error_set_field(err, STATUS_INVALID, path, "unknown parameter '%.60s':%s", key, text);
}
