#include "tests/support/cloth/proxy_cloth.h"
#include "renderer/mesh/mesh_curves.h"
#include "renderer/mesh/mesh_shapes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check(status s, const struct error *err)
{
    if (s == STATUS_OK) return;
    fprintf(stderr, "%s\n", err->text);
    abort();
}

static void make_look(struct appearance_table *t, size_t n_side)
{
    const float through = 0.25f;
    *t = (struct appearance_table){
        .width = 1, .height = 1, .n_basis = 4, .view_edge = 1, .light_edge = 1, .n_side = n_side, .tile_mm = {1, 1}};
    t->weight = calloc(t->n_basis, sizeof *t->weight);
    t->value = calloc(n_side * n_side * t->n_basis * 3, sizeof *t->value);
    if (t->weight == NULL || t->value == NULL) abort();
    t->weight[0] = 1;
    for (size_t view = 0; view < n_side; view++)
        for (size_t light = 0; light < n_side; light++)
            for (size_t c = 0; c < 3; c++)
                t->value[((view * n_side + light) * t->n_basis) * 3 + c] =
                    (float)PROXY_CLOTH_VALUE * (view == light ? 1 : through);
}

void proxy_cloth_init(struct proxy_cloth *c, bool folds)
{
    struct mesh m = {0};
    struct error err = {0};
    memset(c, 0, sizeof *c);
    dual_cloth_weave(&c->flat, 0.6, NULL);
    check(folds ? mesh_folds_make(&(struct mesh_folds){60, 40, 1.15, 3}, &m, &err)
                : mesh_flat((const double[2]){60, 60}, (const size_t[2]){8, 8}, &m, &err),
          &err);
    check(scene_bend(c->flat.scene, &m, !folds, &c->bent, &err), &err);
    mesh_release(&m);
    make_look(&c->look, folds ? 2 : 1);
    c->view = (struct configuration){.light_theta_rad = folds ? 1.3 : 0.7,
                                     .light_phi_rad = folds ? 5.9 : 0.3,
                                     .camera_theta_rad = folds ? 1.2 : 0.5,
                                     .camera_phi_rad = folds ? 4.6 : 4,
                                     .light_distance_m = 0.25,
                                     .lamp_side_m = 0.1,
                                     .camera_distance_m = 0.3,
                                     .crop_m = 0.04};
    c->q = (struct proxy_request){
        .scene = c->bent, .configuration = &c->view, .look = &c->look, .width = 64, .height = 64, .n_side = 4};
}

void proxy_cloth_release(struct proxy_cloth *c)
{
    appearance_table_release(&c->look);
    scene_free(c->bent);
    dual_cloth_release(&c->flat);
}
