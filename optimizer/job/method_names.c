#include "optimizer/job/method_names.h"

#include <stddef.h>

static const char *const method_name[] = {METHOD_GAUSS_NEWTON, METHOD_PUBLISHED_SGD, NULL};

const char *const *method_name_list(void) { return method_name; }
