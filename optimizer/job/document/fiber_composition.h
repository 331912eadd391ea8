/* What a cloth is made of, as on its label: "60 % cotton, 40 % polyester". For exports; no computation uses it. */
#ifndef SELVEDGE_OPTIMIZER_FIBER_COMPOSITION_H
#define SELVEDGE_OPTIMIZER_FIBER_COMPOSITION_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { FIBER_COMPOSITION_MOST = 12, FIBER_NAME_BYTES = 64 };

struct fiber_composition {
    size_t n_part;
    struct {
        double share; /* of the weight; all sum to 1 */
        char name[FIBER_NAME_BYTES];
    } part[FIBER_COMPOSITION_MOST];
};

/* STATUS_INVALID: a part that is no percentage and name, too many parts, or percentages that do not sum to 100 within
 * 0.5. "": no parts. */
status fiber_composition_read(const char *text, struct fiber_composition *c, struct error *err);

#endif
