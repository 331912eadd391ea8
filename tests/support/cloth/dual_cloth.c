#include "tests/support/cloth/dual_cloth.h"
#include "tests/support/cloth/hand_weave.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

const double dual_cloth_wide[9] = {0.2, 0.1, 0.05, 0.9, 0.6, 0.4, 10, 30, 40};
const double dual_cloth_narrow[9] = {0.1, 0.1, 0.1, 0.8, 0.5, 0.3, 2, 10, 8};

void dual_cloth_init(struct dual_cloth *c, struct fiber_set *f, double fraction, const double *two_lobe)
{
    struct error err = {0};
    memset(c, 0, sizeof *c);
    if (scene_new(f, &(struct scene_option){false}, &c->scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(f);
    c->model = scattering_find(two_lobe != NULL ? "two_lobe.v1" : "isotropic.v1");
    for (size_t p = 0; p < c->model->n_param; p++)
        c->param[p] = two_lobe != NULL ? param_from_file_unit(&c->model->param[p], two_lobe[p]) : fraction;
    if (dual_tables_init(&c->tables, c->scene, c->model, c->param, 0, NULL, NULL, &err) != STATUS_OK)
        fail_msg("%s", err.text);
}

void dual_cloth_weave(struct dual_cloth *c, double fraction, const double *two_lobe)
{
    struct fiber_set f;
    hand_weave_small(&f);
    dual_cloth_init(c, &f, fraction, two_lobe);
}

void dual_cloth_release(struct dual_cloth *c)
{
    dual_tables_release(&c->tables);
    scene_free(c->scene);
}
