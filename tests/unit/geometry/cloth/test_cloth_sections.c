/* Flat fibers of described cloths: their sections turn with the yarn and lie across the fibers, in every structure. */
#include "geometry/cloth/cloth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static void set_number(struct cloth_description *d, const char *name, double value)
{
    int i = cloth_number_index(d, name);
    assert_true(i >= 0);
    d->number[i].value = value;
}

static struct cloth_description cloth_of(const char *weave)
{
    struct cloth_description d;
    assert_int_equal(cloth_description_init(&d, weave, NULL), STATUS_OK);
    for (size_t k = 0; k < d.n_kind; k++) d.kind[k].n_fiber = d.structure == CLOTH_FELT ? 60 : 8;
    assert_int_equal(cloth_description_check(&d, NULL), STATUS_OK);
    return d;
}

static void build(const struct cloth_description *d, struct fiber_set *f)
{
    struct error err = {0};
    struct cloth_report r;
    fiber_set_init(f);
    if (cloth_build(d, NULL, NULL, NULL, f, &r, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
}

/* The direction of a fiber at vertex k, that of both neighbours. */
static void direction_at(const struct fiber_set *f, size_t i, size_t k, double t[3])
{
    const size_t from = k > f->first_vertex[i] ? k - 1 : k, to = k + 1 < f->first_vertex[i + 1] ? k + 1 : k;
    double length2 = 0.0;
    for (size_t a = 0; a < 3; a++) {
        t[a] = (double)f->position_m[3 * to + a] - (double)f->position_m[3 * from + a];
        length2 += t[a] * t[a];
    }
    for (size_t a = 0; a < 3; a++) t[a] /= sqrt(length2);
}

/* Fibers lie where round ones do, bit by bit; every vertex of a flat kind has a long axis across its fiber. */
static void test_every_structure(void **state)
{
    (void)state;
    static const char *const weave[] = {"plain", "jersey", "velvet", "felt"};
    for (int w = 0; w < 4; w++) {
        struct cloth_description d = cloth_of(weave[w]);
        struct fiber_set round, f;
        build(&d, &round);
        assert_null(round.shape);
        const size_t flat = d.n_kind - 1; /* of a velvet: the pile alone */
        char name[48];
        snprintf(name, sizeof name, "yarns[%zu].fiber_flatness", flat);
        set_number(&d, name, 2.5);
        build(&d, &f);
        assert_int_equal(f.n_vertex, round.n_vertex);
        assert_memory_equal(f.position_m, round.position_m, 3 * f.n_vertex * sizeof *f.position_m);
        assert_non_null(f.shape);
        for (size_t i = 0; i < f.n_fiber; i++)
            for (size_t k = f.first_vertex[i]; k < f.first_vertex[i + 1]; k++) {
                const struct fiber_shape *s = &f.shape[k];
                double t[3], along = 0.0;
                assert_int_equal(fiber_shape_has_section(s), f.group[i] == flat);
                assert_true(s->ratio == (f.group[i] == flat ? 2.5f : 1.0f) && s->radius == f.radius_m[i]);
                direction_at(&f, i, k, t);
                for (int a = 0; a < 3; a++) along += t[a] * (double)s->long_axis[a];
                assert_true(fabs(along) < 1e-5);
            }
        fiber_set_release(&round);
        fiber_set_release(&f);
    }
}

/* The long axes of the fibers of a straight yarn turn with its twist. Fibers that press each other lean by some
 * tenths of a radian, and so do their sections; the mean over fibers, weighted by their length, is the twist of
 * the yarn within four standard errors. */
static void test_sections_turn_with_the_yarn(void **state)
{
    (void)state;
    const double twist_per_m = 800.0, flatness = 4.0;
    /* a flat yarn turns more slowly (geometry/cloth/README.md) */
    const double rad_per_m = 2.0 * M_PI * twist_per_m / sqrt(flatness);
    struct cloth_description d = cloth_of("plain");
    struct fiber_set f;
    const char *const still[] = {"disorder", "yarns[0].migration", "yarns[0].fiber_angle_deg"};
    for (int i = 0; i < 3; i++) set_number(&d, still[i], 0.0);
    set_number(&d, "crimp", 1.0); /* the weft is straight */
    set_number(&d, "yarns[0].flatness", flatness);
    set_number(&d, "yarns[0].twist_per_m", twist_per_m);
    set_number(&d, "yarns[0].fiber_flatness", 2.5);
    build(&d, &f);
    double turned = 0.0, length_m = 0.0, square = 0.0;
    for (size_t i = 0; i < f.n_fiber; i++) {
        const size_t first = f.first_vertex[i], last = f.first_vertex[i + 1] - 1;
        double own = 0.0;
        if (f.axis_class[i] != 0) continue;
        for (size_t k = first; k < last; k++) {
            const float *u = f.shape[k].long_axis, *v = f.shape[k + 1].long_axis;
            own += atan2((double)u[1] * (double)v[2] - (double)u[2] * (double)v[1],
                         (double)u[1] * (double)v[1] + (double)u[2] * (double)v[2]);
        }
        const double own_m = (double)f.position_m[3 * last] - (double)f.position_m[3 * first];
        turned += own;
        length_m += own_m;
        square += (own - rad_per_m * own_m) * (own - rad_per_m * own_m);
    }
    print_message("%.2f rad, %.2f by the twist, standard error %.2f\n", turned, rad_per_m * length_m, sqrt(square));
    assert_true(fabs(turned - rad_per_m * length_m) < 4.0 * sqrt(square) && sqrt(square) < 0.02 * turned);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_structure),
                                       cmocka_unit_test(test_sections_turn_with_the_yarn)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
