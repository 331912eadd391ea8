#include "renderer/scattering/surface/scattering_registry.h"

#include <string.h>

static const struct scattering_model *const registry[] = {
#define SURFACE_MODEL(name, ...) &scattering_##name,
#define VOLUME_MODEL(name, ...)
#include "base/catalogue/models.def"
    NULL,
};

const struct scattering_model *const *scattering_registry(void) { return registry; }

const struct scattering_model *scattering_find(const char *id)
{
    for (size_t i = 0; registry[i] != NULL; i++)
        if (strcmp(registry[i]->id, id) == 0) return registry[i];
    return NULL;
}

int scattering_param_index(const struct scattering_model *m, const char *name)
{
    return param_index(m->param, m->n_param, name);
}

status scattering_check_param(const struct scattering_model *m, const double *param, struct error *err)
{
    for (size_t i = 0; i < m->n_param; i++) {
        const struct param_info *p = &m->param[i];
        double slack = 1e-9 * (p->upper - p->lower); /* a bound that went through a file and back is still inside */
        if (!(param[i] >= p->lower - slack && param[i] <= p->upper + slack))
            return error_set_field(err, STATUS_INVALID, p->name,
                                   "cannot use scattering model '%s': parameter '%s' is %g %s, allowed are %g to %g",
                                   m->id, p->name, param_to_file_unit(p, param[i]), param_unit_name(p->unit),
                                   param_to_file_unit(p, p->lower), param_to_file_unit(p, p->upper));
    }
    return STATUS_OK;
}
