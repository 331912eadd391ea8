/* Conditions that each row of the catalogues of models and methods must satisfy, also against the registries. */
#include "base/catalogue/method_catalogue.h"
#include "base/catalogue/model_sets.h"
#include "base/catalogue/stop_reason.h"
#include "optimizer/fit/descent/descent.h"
#include "renderer/scattering/appearance.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void check_parameter(const struct model_info *m, const struct param_info *p)
{
    bool logarithm = p->coordinate == PARAM_LOG || p->coordinate == PARAM_LOGIT;
    size_t n = strlen(p->meaning);
    if (!(p->lower < p->upper && p->start >= p->lower && p->start <= p->upper))
        fail_msg("%s: %s starts at %g, its range is %g to %g", m->id, p->name, p->start, p->lower, p->upper);
    if (n < 10 || p->meaning[n - 1] != '.') fail_msg("%s: %s means '%s'", m->id, p->name, p->meaning);
    assert_true(p->unit < PARAM_N_UNIT && p->kind < PARAM_N_KIND && p->coordinate < PARAM_N_COORDINATE);
    assert_true(p->kind != PARAM_NUISANCE);
    if (logarithm && !(p->lower > 0)) fail_msg("%s: %s has no logarithm at %g", m->id, p->name, p->lower);
    if (p->coordinate == PARAM_LOGIT && !(p->upper < 1)) fail_msg("%s: %s has no logit", m->id, p->name);
    if (p->kind == PARAM_LOBE_WIDTH) assert_int_equal(p->unit, PARAM_UNIT_DEG);
}

/* The three parameters of a colour follow each other: "C_R.r", "C_R.g", "C_R.b". All others are single. */
static void check_slots(const struct model_info *m)
{
    for (size_t p = 0, channel = 0; p < m->n_param; p++) {
        const struct param_info *k = &m->param[p];
        char name[64];
        if (k->kind != PARAM_COLOUR) {
            assert_int_equal(channel, 0);
            assert_int_equal(k->channel, -1);
            assert_string_equal(k->name, k->symbol);
            continue;
        }
        snprintf(name, sizeof name, "%s.%c", k->symbol, "rgb"[channel]);
        assert_string_equal(k->name, name);
        assert_int_equal(k->channel, channel);
        channel = (channel + 1) % 3;
    }
}

static void models_are_sound(void **unused)
{
    (void)unused;
    size_t n = 0;
    for (const struct model_info *m; (m = model_catalogue_at(n)) != NULL; n++) {
        assert_ptr_equal(model_catalogue_find(m->id), m); /* no other has its id */
        assert_true(strlen(m->title) > 10);
        assert_true(m->n_param >= 1 && m->n_param <= MODEL_MAX_PARAM);
        for (size_t p = 0; p < m->n_param; p++) {
            check_parameter(m, &m->param[p]);
            assert_int_equal(param_index(m->param, m->n_param, m->param[p].name), p);
            assert_true((m->param[p].kind == PARAM_DENSITY) == (m->kind == MODEL_VOLUME && p == m->n_param - 1));
        }
        check_slots(m);
    }
    assert_true(n >= 8);
    assert_null(model_catalogue_find("no_such_model.v1"));
}

static void registries_follow_the_catalogue(void **unused)
{
    (void)unused;
    const struct scattering_model *const *surface = scattering_registry();
    const struct phase_model *const *volume = phase_registry();
    for (size_t i = 0; model_catalogue_at(i) != NULL; i++) {
        const struct model_info *m = model_catalogue_at(i);
        bool s = m->kind == MODEL_SURFACE;
        assert_string_equal(s ? (*surface)->id : (*volume)->id, m->id);
        assert_string_equal(s ? (*surface)->title : (*volume)->title, m->title);
        assert_ptr_equal(s ? (*surface)->param : (*volume)->param, m->param);
        assert_int_equal(s ? (*surface)->n_param : (*volume)->n_param + 1, m->n_param);
        assert_int_equal(model_catalogue_has_modes(m->id), s && (*surface)->mode != NULL);
        assert_int_equal(model_catalogue_has_flat_section(m->id), s && (*surface)->flat_section);
        if (s)
            surface++;
        else
            volume++;
    }
    assert_null(*surface);
    assert_null(*volume);
}

static void methods_are_sound(void **unused)
{
    (void)unused;
    const struct descent_method *const *method = descent_registry();
    size_t n = 0;
    for (const struct method_info *m; (m = method_catalogue_at(n)) != NULL; n++) {
        assert_ptr_equal(method_catalogue_find(m->id), m);
        assert_non_null(method[n]);
        assert_ptr_equal(method[n]->info, m);
        assert_ptr_equal(descent_find(m->id), method[n]);
        assert_true(strlen(m->title) > 10 && m->default_max_iteration > 0 && m->max_iteration_of_starts > 0);
        assert_true(m->takes < 1u << METHOD_N_ABILITY);
    }
    assert_null(method[n]);
    assert_null(method_catalogue_find("no_such_method.v1"));
    assert_string_equal(method_catalogue_at(0)->id, "gauss_newton.v1"); /* the documented default */
    assert_ptr_equal(method_catalogue_taking(METHOD_TAKES_PRIORS | METHOD_TAKES_TEXTURE), &method_gauss_newton);
    assert_null(method_catalogue_taking(1u << METHOD_N_ABILITY));
}

static void stop_reasons_are_sound(void **unused)
{
    (void)unused;
    for (int i = 0; i < STOP_N_REASON; i++) {
        const struct stop_reason_info *r = stop_reason_info((enum stop_reason)i);
        assert_true(r->id != NULL && r->id[0] != '\0' && r->id[strspn(r->id, "abcdefghijklmnopqrstuvwxyz_")] == '\0');
        assert_true(strlen(r->meaning) > 10 && r->meaning[strlen(r->meaning) - 1] == '.');
        for (int k = 0; k < i; k++) assert_string_not_equal(r->id, stop_reason_info((enum stop_reason)k)->id);
    }
}

static void units_convert(void **unused)
{
    (void)unused;
    const struct param_info angle = {.unit = PARAM_UNIT_DEG}, density = {.unit = PARAM_UNIT_PER_CM}, plain = {0};
    assert_true(param_from_file_unit(&angle, 10.0) == 10.0 * (M_PI / 180.0));
    assert_true(fabs(param_to_file_unit(&angle, M_PI) - 180.0) < 1e-13);
    assert_true(param_from_file_unit(&density, 4000.0) == 4e5 && param_to_file_unit(&density, 4e5) == 4000.0);
    assert_true(param_from_file_unit(&plain, 0.3) == 0.3 && param_to_file_unit(&plain, 0.3) == 0.3);
    assert_string_equal(param_unit_name(PARAM_UNIT_DEG), "deg");
    assert_string_equal(param_unit_name(PARAM_UNIT_PER_CM), "1/cm");
    assert_string_equal(param_unit_name(PARAM_UNIT_NONE), "");
}

/* The outer model has the parameters of the inner one and one more, whose
 * starts lie in its range. */
static void nestings_are_sound(void **unused)
{
    (void)unused;
    for (size_t i = 0; model_catalogue_nesting(i) != NULL; i++) {
        const struct model_nesting *n = model_catalogue_nesting(i);
        const struct model_info *outer = model_catalogue_find(n->outer), *inner = model_catalogue_find(n->inner);
        assert_int_equal(outer->n_param, inner->n_param + 1);
        for (size_t p = 0; p < inner->n_param; p++) {
            int k = param_index(outer->param, outer->n_param, inner->param[p].name);
            assert_true(k >= 0);
            assert_true(outer->param[k].lower == inner->param[p].lower &&
                        outer->param[k].upper == inner->param[p].upper);
        }
        int own = param_index(outer->param, outer->n_param, n->symbol);
        assert_true(own >= 0 && param_index(inner->param, inner->n_param, n->symbol) < 0);
        for (size_t k = 0; k < MODEL_N_NESTED_START; k++)
            assert_true(n->start[k] >= outer->param[own].lower && n->start[k] <= outer->param[own].upper);
    }
    assert_non_null(model_catalogue_nesting(0));
}

static void sets_name_their_parameters(void **state)
{
    (void)state;
    static const char set[MODEL_MAX_SET][MODEL_SET_NAME_BYTES] = {"warp", "weft"};
    const struct model_info *m = model_catalogue_find("two_lobe.v1");
    static struct model_sets s;
    struct error err = {0};
    assert_int_equal(model_sets_init(&s, m, set, 2, NULL), STATUS_OK);
    assert_int_equal(s.info.n_param, 2 * m->n_param);
    const struct param_info *p = &s.info.param[m->n_param + 1];
    assert_string_equal(p->name, "weft.C_R.g");
    assert_string_equal(p->symbol, "weft.C_R");
    assert_string_equal(param_own_name(p), "C_R.g");
    assert_true(p->set == set[1] && p->upper == m->param[1].upper && p->channel == 1);
    assert_true(param_is_named(p, "weft.C_R.g") && param_is_named(p, "weft.C_R") && param_is_named(p, "C_R.g") &&
                param_is_named(p, "C_R"));
    assert_true(!param_is_named(p, "warp.C_R.g") && !param_is_named(p, "C_R.r") && !param_is_named(p, "R.g"));
    for (size_t n = 0; n < 2; n++) { /* one set has the names of the model */
        assert_int_equal(model_sets_init(&s, m, set, n, NULL), STATUS_OK);
        assert_true(s.n_set == 1 && s.info.n_param == m->n_param && s.info.param[1].set == NULL);
        assert_string_equal(s.info.param[1].name, "C_R.g");
    }
    assert_int_equal(model_sets_init(&s, model_catalogue_find("microflake.v1"), set, 2, NULL), STATUS_OK);
    assert_int_equal(s.n_set, 1);
    assert_int_equal(model_sets_init(&s, m, set, MODEL_MAX_SET, &err), STATUS_INVALID);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(models_are_sound),       cmocka_unit_test(registries_follow_the_catalogue),
        cmocka_unit_test(methods_are_sound),      cmocka_unit_test(units_convert),
        cmocka_unit_test(stop_reasons_are_sound), cmocka_unit_test(sets_name_their_parameters),
        cmocka_unit_test(nestings_are_sound),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
