#include "base/catalogue/method_catalogue.h"

#include <string.h>

#define DESCENT_METHOD(name, ...) const struct method_info method_##name = {__VA_ARGS__};
#include "base/catalogue/methods.def"

static const struct method_info *const catalogue[] = {
#define DESCENT_METHOD(name, ...) &method_##name,
#include "base/catalogue/methods.def"
    NULL,
};

const struct method_info *method_catalogue_at(size_t i)
{
    return i < sizeof catalogue / sizeof *catalogue ? catalogue[i] : NULL;
}

const struct method_info *method_catalogue_find(const char *id)
{
    for (size_t i = 0; catalogue[i] != NULL; i++)
        if (strcmp(catalogue[i]->id, id) == 0) return catalogue[i];
    return NULL;
}

const struct method_info *method_catalogue_taking(unsigned abilities)
{
    for (size_t i = 0; catalogue[i] != NULL; i++)
        if ((catalogue[i]->takes & abilities) == abilities) return catalogue[i];
    return NULL;
}
