/* A scattering model that is ready; one that is not ends the test. To be included after cmocka.h. */
#ifndef SELVEDGE_TESTS_PREPARED_MODEL_H
#define SELVEDGE_TESTS_PREPARED_MODEL_H

#include "renderer/scattering/scattering.h"

/* The caller releases it by m->release. */
static inline struct scattering_state *prepare(const struct scattering_model *m, const double *param)
{
    struct scattering_state *s = NULL;
    struct error err = {0};
    if (m->prepare(param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    return s;
}

#endif
