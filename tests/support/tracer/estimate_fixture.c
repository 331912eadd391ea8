#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static const char model_id[] = "two_lobe.v1";

int estimate_fixture_init(struct estimate_fixture *x)
{
    struct fiber_set f;
    const struct scattering_model *m = scattering_find(model_id);
    for (size_t p = 0; p < m->n_param; p++) x->start[p] = m->param[p].start;
    orbit_configurations_16(x->configuration);
    hand_weave_small(&f);
    status s = scene_new(&f, &(struct scene_option){true}, &x->scene, NULL);
    fiber_set_release(&f);
    return s != STATUS_OK;
}

void estimate_fixture_release(struct estimate_fixture *x) { scene_free(x->scene); }

struct estimate_request estimate_fixture_request(struct estimate_fixture *x, const size_t *n_path,
                                                 size_t n_configuration)
{
    struct estimate_request q = {.input = trace_input_surface(x->scene, scattering_find(model_id), x->start, &x->model),
                                 .configuration = x->configuration,
                                 .n_configuration = n_configuration,
                                 .n_path = n_path,
                                 .seed = 17,
                                 .iteration = 3,
                                 .replica = 1};
    q.input.want_derivative = true;
    return q;
}

void estimate_fixture_run(const struct estimate_request *q, size_t n_thread, struct estimate *e)
{
    struct thread_pool *pool = NULL;
    struct error err = {0};
    assert_int_equal(thread_pool_new(n_thread, &pool, &err), STATUS_OK);
    if (estimate_run(q, pool, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
    thread_pool_free(pool);
}

void render_fixture_run(const struct render_request *q, size_t n_thread, struct image *im)
{
    struct thread_pool *pool = NULL;
    struct error err = {0};
    assert_int_equal(thread_pool_new(n_thread, &pool, &err), STATUS_OK);
    if (render_run(q, pool, NULL, im, &err) != STATUS_OK) fail_msg("%s", err.text);
    thread_pool_free(pool);
}
