#include "base/catalogue/picture_method.h"

const char *const picture_method_name[] = {
#define PICTURE_METHOD(id, name, ...) name,
#include "base/catalogue/picture_methods.def"
    NULL,
};

static const bool of_flat_cloth[] = {
#define PICTURE_METHOD(id, name, flat, meaning) flat,
#include "base/catalogue/picture_methods.def"
};

bool picture_method_of_flat_cloth(size_t i) { return of_flat_cloth[i]; }
