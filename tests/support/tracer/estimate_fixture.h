/* A small weave, its configurations and estimates of them, for tests of estimate_run, and runs of render_run. Failures
 * fail the test. */
#ifndef SELVEDGE_TESTS_ESTIMATE_FIXTURE_H
#define SELVEDGE_TESTS_ESTIMATE_FIXTURE_H

#include "renderer/estimate/estimate.h"
#include "renderer/estimate/render.h"

#include <stdint.h>

struct estimate_fixture {
    struct scene *scene;
    double start[SCATTERING_MAX_PARAM]; /* of two_lobe.v1 */
    struct appearance model;
    struct configuration configuration[16];
};

/* Returns 0, or 1 when there is no scene. */
int estimate_fixture_init(struct estimate_fixture *x);
void estimate_fixture_release(struct estimate_fixture *x);
/* With derivatives; one seed, iteration and replica for all. */
struct estimate_request estimate_fixture_request(struct estimate_fixture *x, const size_t *n_path,
                                                 size_t n_configuration);
void estimate_fixture_run(const struct estimate_request *q, size_t n_thread, struct estimate *e);
void render_fixture_run(const struct render_request *q, size_t n_thread, struct image *im);

#endif
