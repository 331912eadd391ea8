#include "base/catalogue/param_info.h"
#include "base/angle.h"

#include <string.h>

/* to file unit: value * multiplier / divisor. Each direction has its own constants, because 1 / (pi / 180) is not
 * exactly 180 / pi. */
static const struct {
    const char *name;
    double internal_per_file, multiplier, divisor;
} unit_table[PARAM_N_UNIT] = {
    [PARAM_UNIT_NONE] = {"", 1, 1, 1},
    [PARAM_UNIT_DEG] = {"deg", RAD_PER_DEG, DEG_PER_RAD, 1},
    [PARAM_UNIT_PER_CM] = {"1/cm", 100, 1, 100},
};

static const char *const coordinate_name[PARAM_N_COORDINATE] = {
    [PARAM_LINEAR] = "linear", [PARAM_LOG] = "log", [PARAM_LOGIT] = "logit"};

static const char *const kind_name[PARAM_N_KIND] = {[PARAM_COLOUR] = "colour",
                                                    [PARAM_LOBE_WIDTH] = "lobe_width",
                                                    [PARAM_SHAPE] = "shape",
                                                    [PARAM_DENSITY] = "density",
                                                    [PARAM_NUISANCE] = "nuisance"};

const char *param_unit_name(enum param_unit unit) { return unit_table[unit].name; }
const char *param_coordinate_name(enum param_coordinate coordinate) { return coordinate_name[coordinate]; }
const char *param_kind_name(enum param_kind kind) { return kind_name[kind]; }

double param_from_file_unit(const struct param_info *p, double value)
{
    return value * unit_table[p->unit].internal_per_file;
}

double param_to_file_unit(const struct param_info *p, double value)
{
    return value * unit_table[p->unit].multiplier / unit_table[p->unit].divisor;
}

static const char *without_set(const struct param_info *p, const char *text)
{
    return p->set != NULL ? text + strlen(p->set) + 1 : text;
}

const char *param_own_name(const struct param_info *p) { return without_set(p, p->name); }
const char *param_own_symbol(const struct param_info *p) { return without_set(p, p->symbol); }

bool param_is_named(const struct param_info *p, const char *key)
{
    return strcmp(p->name, key) == 0 || strcmp(p->symbol, key) == 0 || strcmp(param_own_name(p), key) == 0 ||
           strcmp(param_own_symbol(p), key) == 0;
}

int param_index(const struct param_info *info, size_t n_param, const char *name)
{
    for (size_t p = 0; p < n_param; p++)
        if (strcmp(info[p].name, name) == 0) return (int)p;
    return -1;
}

status param_check(const struct param_info *info, size_t n_param, const char *model_id, const double *param,
                   struct error *err)
{
    for (size_t i = 0; i < n_param; i++) {
        const struct param_info *p = &info[i];
        double slack = 1e-9 * (p->upper - p->lower);
        if (!(param[i] >= p->lower - slack && param[i] <= p->upper + slack))
            return error_set_field(err, STATUS_INVALID, p->name,
                                   "cannot use scattering model '%s': parameter '%s' is %g %s, allowed are %g to %g",
                                   model_id, p->name, param_to_file_unit(p, param[i]), param_unit_name(p->unit),
                                   param_to_file_unit(p, p->lower), param_to_file_unit(p, p->upper));
    }
    return STATUS_OK;
}
