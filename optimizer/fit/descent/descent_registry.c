#include "optimizer/fit/descent/descent_methods.h"

#include <string.h>

static const struct descent_method *const method[] = {
#define DESCENT_METHOD(name, ...) &descent_##name,
#include "base/catalogue/methods.def"
    NULL,
};

const struct descent_method *const *descent_registry(void) { return method; }

const struct descent_method *descent_find(const char *id)
{
    for (size_t i = 0; method[i] != NULL; i++)
        if (strcmp(method[i]->info->id, id) == 0) return method[i];
    return NULL;
}
