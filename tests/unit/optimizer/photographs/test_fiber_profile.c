/* Tables of the profile of a fiber: what is read of them, and errors that name line and column. */
#include "base/angle.h"
#include "base/option_id.h"
#include "optimizer/photographs/profile/fiber_profile.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static status parse(const char *text, double theta_i_deg, struct fiber_profile *p, struct error *err)
{
    return fiber_profile_parse(p, text, strlen(text), "p.csv", theta_i_deg, err);
}

static void grey_and_colored(void **unused)
{
    struct fiber_profile p;
    struct error err = {0};
    (void)unused;
    assert_int_equal(parse("# of a goniometer\nphi_deg;theta_o_deg;radiance\n-20;10;0,5\n180;40;0\n", -40, &p, &err),
                     STATUS_OK);
    assert_true(p.n == 2 && p.n_channel == 1 && !p.has_se && p.last_line == 4);
    assert_true(fabs(p.row[0].phi_rad - (-20 * RAD_PER_DEG)) < 1e-12);
    assert_true(fabs(p.row[0].theta_o_rad - (10 * RAD_PER_DEG)) < 1e-12);
    assert_true(fabs(p.row[1].theta_i_rad - (-40 * RAD_PER_DEG)) < 1e-12);
    assert_true(fabs(p.row[0].radiance[0] - (0.5)) < 1e-12);
    fiber_profile_release(&p);
    assert_int_equal(parse("theta_i_deg,theta_o_deg,phi_deg,radiance_r,radiance_g,radiance_b,radiance_r_se,"
                           "radiance_g_se,radiance_b_se\n30,-30,180,1,2,3,.1,.2,.3\n",
                           NAN, &p, &err),
                     STATUS_OK);
    assert_true(p.n == 1 && p.n_channel == 3 && p.has_se);
    assert_true(fabs(p.row[0].radiance[2] - (3)) < 1e-12);
    assert_true(fabs(p.row[0].se[1] - (0.2)) < 1e-12);
    fiber_profile_release(&p);
}

/* Azimuths of the light, in degrees; and what is printed is read again. */
static void azimuths_of_the_light(void **unused)
{
    static const char table[] = "phi_i_deg,theta_o_deg,phi_deg,radiance\n-90,10,-20,0.5\n350,40,180,2\n";
    struct fiber_profile p, again;
    struct error err = {0};
    char *text = NULL;
    size_t n = 0;
    (void)unused;
    assert_int_equal(parse(table, -40, &p, &err), STATUS_OK);
    assert_true(p.has_phi_i && fabs(p.row[0].phi_i_rad + M_PI_2) < 1e-12);
    assert_true(fabs(p.row[1].phi_i_rad - 350 * RAD_PER_DEG) < 1e-12);
    FILE *out = open_memstream(&text, &n);
    assert_non_null(out);
    fiber_profile_print(&p, out);
    fclose(out);
    assert_string_equal(text, "theta_i_deg,phi_i_deg,theta_o_deg,phi_deg,radiance\n-40,-90,10,-20,0.5\n"
                              "-40,350,40,180,2\n");
    assert_int_equal(parse(text, NAN, &again, &err), STATUS_OK);
    for (size_t i = 0; i < 2; i++) assert_true(fabs(again.row[i].phi_i_rad - p.row[i].phi_i_rad) < 1e-6);
    fiber_profile_release(&again);
    fiber_profile_release(&p);
    free(text);
    assert_int_equal(parse("theta_o_deg,phi_deg,radiance\n10,0,1\n", 0, &p, &err), STATUS_OK);
    assert_true(!p.has_phi_i && !(fabs(p.row[0].phi_i_rad) > 0));
    fiber_profile_release(&p);
}

static void refused(void **unused)
{
    static const struct {
        const char *text;
        double theta_i_deg;
        const char *says[3];
    } wrong[] = {
        {"phi_deg,radiance\n1,1\n", 0, {"line 1", "'theta_o_deg' is missing"}},
        {"theta_o_deg,radiance\n1,1\n", 0, {"line 1", "'phi_deg' is missing"}},
        {"theta_o_deg,phi_deg\n1,1\n", 0, {"line 1", "'radiance' is missing"}},
        {"theta_o_deg,phi_deg,radiance\n1,1,1\n", NAN, {"line 1", "'theta_i_deg' is missing"}},
        {"theta_o_deg,phi_deg,radiance,theta_i_deg\n1,1,1,1\n", 0, {"line 1", "'theta_i_deg'", "so is the job's"}},
        {"theta_o_deg,phi_deg,radiance_r,radiance_b\n1,1,1,1\n", 0, {"line 1", "'radiance_g' is missing"}},
        {"theta_o_deg,phi_deg,radiance,radiance_r\n1,1,1,1\n", 0, {"line 1", "'radiance'"}},
        {"theta_o_deg,phi_deg,radiance_r,radiance_g,radiance_b,radiance_g_se\n1,1,1,1,1,1\n",
         0,
         {"line 1", "'radiance_r_se' is missing"}},
        {"theta_o_rad,phi_deg,radiance\n1,1,1\n", 0, {"line 1", "unknown column 'theta_o_rad'"}},
        {"theta_o_deg,phi_deg,radiance\n10,0,1\n91,0,1\n", 0, {"line 3", "'theta_o_deg' is 91", "-89.9 to 89.9"}},
        {"theta_o_deg,phi_deg,radiance\n10,400,1\n", 0, {"line 2", "'phi_deg' is 400", "-360 to 360"}},
        {"theta_o_deg,phi_deg,radiance\n10,0,1\n20,0,-0.5\n", 0, {"line 3", "'radiance' is -0.5"}},
        {"theta_o_deg,phi_deg,radiance\n10,0,1\n20,0,x\n", 0, {"line 3", "'radiance'", "'x' is not a number"}},
        {"theta_o_deg,phi_deg,radiance\n10,0,nan\n", 0, {"line 2", "'radiance'"}},
        {"theta_o_deg,phi_deg,radiance\n10,0\n", 0, {"line 2", "2 cells", "3 columns"}},
        {"theta_o_deg,phi_deg,radiance,radiance_se\n10,0,1,0\n", 0, {"line 2", "'radiance_se' is 0"}},
        {"theta_o_deg,phi_deg,radiance\n.17,-.35,1\n.35,3.14,2\n.87,3.49,1\n",
         0,
         {"line 4", "'theta_o_deg' and 'phi_deg'", "radians"}},
        {"phi_i_rad,theta_o_deg,phi_deg,radiance\n1,1,1,1\n", 0, {"line 1", "unknown column 'phi_i_rad'"}},
        {"phi_i_deg,theta_o_deg,phi_deg,radiance\n0,10,0,1\n-361,10,0,1\n",
         0,
         {"line 3", "'phi_i_deg' is -361", "-360 to 360"}},
        {"phi_i_deg,theta_o_deg,phi_deg,radiance\nx,10,0,1\n", 0, {"line 2", "'phi_i_deg'", "'x' is not a number"}},
        {"theta_o_deg,phi_deg,radiance\n", 0, {"line 1", "no row"}},
        {"theta_o_deg,phi_deg,radiance\n10,0,0\n20,0,0\n", 0, {"line 3", "'radiance' is 0"}},
        {"theta_o_deg,phi_deg,radiance\n10,0,0\n20,0,1e-200\n", 0, {"line 3", "'radiance' is 1e-200", "another unit"}},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct fiber_profile p;
        struct error err = {0};
        assert_int_not_equal(parse(wrong[i].text, wrong[i].theta_i_deg, &p, &err), STATUS_OK);
        assert_string_equal(err.field, OPTION_PROFILE_FILE);
        assert_non_null(strstr(err.text, "p.csv"));
        for (int k = 0; k < 3 && wrong[i].says[k] != NULL; k++)
            if (strstr(err.text, wrong[i].says[k]) == NULL) fail_msg("'%s' lacks '%s'", err.text, wrong[i].says[k]);
        assert_null(p.row);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(grey_and_colored), cmocka_unit_test(azimuths_of_the_light),
                                       cmocka_unit_test(refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
