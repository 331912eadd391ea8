#include "renderer/scattering/surface/scattering_registry.h"

#include <math.h>
#include <string.h>

static const struct scattering_model *const registry[] = {
    &scattering_two_lobe,   &scattering_two_lobe_balanced, &scattering_isotropic,
    &scattering_kajiya_kay, &scattering_marschner,         NULL,
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
    for (size_t p = 0; p < m->n_param; p++)
        if (strcmp(m->param[p].name, name) == 0) return (int)p;
    return -1;
}

/* Internal units per unit of files. */
static double file_unit(const struct param_info *p)
{
    if (strcmp(p->unit, "deg") == 0) return M_PI / 180;
    return strcmp(p->unit, "1/cm") == 0 ? 100 : 1;
}

double param_from_file_unit(const struct param_info *p, double value) { return value * file_unit(p); }

double param_to_file_unit(const struct param_info *p, double value)
{
    return strcmp(p->unit, "deg") == 0 ? value * (180 / M_PI) : value / file_unit(p);
}

status scattering_check_param(const struct scattering_model *m, const double *param, struct error *err)
{
    for (size_t i = 0; i < m->n_param; i++) {
        const struct param_info *p = &m->param[i];
        double slack = 1e-9 * (p->upper - p->lower); /* a bound that went through a file and back is still inside */
        if (!(param[i] >= p->lower - slack && param[i] <= p->upper + slack))
            return error_set_field(err, STATUS_INVALID, p->name,
                                   "cannot use scattering model '%s': parameter '%s' is %g %s, allowed are %g to %g",
                                   m->id, p->name, param_to_file_unit(p, param[i]), p->unit,
                                   param_to_file_unit(p, p->lower), param_to_file_unit(p, p->upper));
    }
    return STATUS_OK;
}
