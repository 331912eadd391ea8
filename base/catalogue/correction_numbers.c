#include "base/catalogue/correction_numbers.h"

#include <math.h>
#include <stdio.h>

#define CORRECTION_NUMBER(name, unit, lower, upper, standard, coordinate, meaning)                                     \
    {#name, unit, false, lower, upper, standard, coordinate, 0, meaning},
const struct cloth_number_info correction_number_table[] = {
#include "base/catalogue/correction_numbers.def"
};
_Static_assert(sizeof correction_number_table / sizeof *correction_number_table == CORRECTION_N,
               "enum correction_number has a name for each row");

void correction_numbers_init(struct cloth_number number[CORRECTION_N])
{
    for (int k = 0; k < CORRECTION_N; k++) {
        const struct cloth_number_info *info = &correction_number_table[k];
        number[k] = (struct cloth_number){.info = info,
                                          .kind = -1,
                                          .value = info->standard,
                                          .lower = info->lower,
                                          .upper = info->upper,
                                          .prior_mean = NAN,
                                          .prior_sd = NAN};
        snprintf(number[k].name, sizeof number[k].name, "%s", info->name);
    }
}

status correction_numbers_check(const struct cloth_number number[CORRECTION_N], struct error *err)
{
    status s = STATUS_OK;
    for (int k = 0; k < CORRECTION_N && s == STATUS_OK; k++) s = cloth_number_check_one(&number[k], err);
    return s;
}
