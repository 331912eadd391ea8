/* Every scattering model in the registry: no more light leaves a fiber than comes, whatever the direction it comes
 * from. The exceptions, marschner.v1 at grazing directions and light onto hair_mixture.v1, which follows the published
 * division by the cosine of the light, are bounded too. What a fiber that absorbs nothing loses
 * or gains is at most what docs/model.md states, from either side.
 */
#include "base/angle.h"
#include "tests/support/agreement.h"
#include "tests/support/model/model_furnace.h"
#include "tests/support/model/model_stream.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The largest share of the light that may leave. 2e-3: quadrature, and the tables of two_lobe near the poles.
 * marschner.v1 takes the attenuation at the difference angle of both directions, which lies off grazing where its lobes
 * are wide: up to 1.49 was found at 89.5 degrees (docs/model.md, section 2). */
static double most_leaving(const struct scattering_model *m, double theta_deg)
{
    bool grazing_gain = strcmp(m->id, "marschner.v1") == 0 && fabs(theta_deg) > 60;
    /* Six views stand for all, and the cells of the table of a(th) are wide against cos th there. */
    bool few_views = m->near_field && fabs(theta_deg) > 89;
    return grazing_gain ? 1.5 : few_views ? 1 + 5e-3 : 1 + 2e-3;
}

/* hair_mixture.v1 keeps the light that is followed from the view alone. */
static bool keeps_light(const struct scattering_model *m) { return strcmp(m->id, "hair_mixture.v1") != 0; }

static void no_model_gains_energy(void **state)
{
    (void)state;
    for (size_t k = 0; scattering_registry()[k] != NULL; k++) {
        const struct scattering_model *m = scattering_registry()[k];
        struct rng r;
        model_stream_start(&r, 41, m->id);
        for (int set = 0; set < 4; set++) {
            double param[SCATTERING_MAX_PARAM];
            for (size_t p = 0; p < m->n_param; p++) { /* brightest; start; brightest and narrow; anything */
                const struct param_info *i = &m->param[p];
                double t = set == 0 ? 1 : set == 2 && i->channel < 0 ? 0.05 : set == 2 ? 1 : rng_double(&r);
                param[p] = set == 1 ? i->start : i->lower + t * (i->upper - i->lower);
            }
            struct scattering_state *s = NULL;
            struct error err = {0};
            if (m->prepare(param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
            const double theta_deg[6] = {0, 20, -45, 70, -85, 89.5};
            /* by day every other direction, the next set having the others */
            const int step = is_long_variant() ? 1 : 2;
            for (int a = set % step; a < 6; a += step) {
                /* Midpoints 0.4 degrees apart see lobes of one degree to 1e-6; a mean over views needs less of them. */
                const struct model_furnace fine = {.n_theta = 450, .n_phi = 180},
                                           views = {.n_theta = 450, .n_phi = 120, .n_view = 6};
                double sum[3];
                model_furnace(m, s, m->near_field ? &views : &fine, theta_deg[a] * RAD_PER_DEG, keeps_light(m), sum);
                for (int c = 0; c < 3; c++)
                    if (!(sum[c] > 0 && sum[c] < most_leaving(m, theta_deg[a])))
                        fail_msg("%s, set %d, %g degrees: %.5f of the light leaves", m->id, set, theta_deg[a], sum[c]);
            }
            m->release(s);
        }
    }
}

/* What a model may lose and gain up to 80 degrees, of light from one direction to all (in) and from all to one (out).
 * Models that are not named keep all of it within 2e-3, as above. */
struct balance {
    const char *id;
    double loss[2], gain[2];
};

static struct balance stated_balance(const struct scattering_model *m)
{
    static const struct balance stated[] = {
        {"two_lobe.v1", {2e-3, 0.28}, {2e-3, 0.01}}, {"two_lobe_diffuse.v1", {2e-3, 0.28}, {2e-3, 0.01}},
        {"kajiya_kay.v1", {0.1, 0.1}, {2e-3, 2e-3}}, {"marschner.v1", {0.21, 0.21}, {2e-3, 2e-3}},
        {"film.v1", {0.15, 0.15}, {2e-3, 2e-3}},     {"hair_mixture.v1", {0.03, 2e-3}, {0.7, 2e-3}}};
    for (size_t k = 0; k < sizeof stated / sizeof stated[0]; k++)
        if (strcmp(stated[k].id, m->id) == 0) return stated[k];
    return (struct balance){m->id, {2e-3, 2e-3}, {2e-3, 2e-3}};
}

/* Colors of 0.999 and 0.998, from which 1 is extrapolated; a medulla absorbs least; everything else at its start. */
static void clear_fiber(const struct scattering_model *m, double *param)
{
    for (size_t p = 0; p < m->n_param; p++) {
        const struct param_info *i = &m->param[p];
        param[p] = i->channel >= 0                      ? 0.999 - 0.001 * i->channel
                   : strcmp(i->symbol, "sigma_ma") == 0 ? i->lower
                                                        : i->start;
    }
}

static void both_sides_keep_what_is_stated(void **state)
{
    (void)state;
    const struct model_furnace q = {.n_theta = 300, .n_phi = 240, .n_view = 12, .azimuth_rad = 0.35};
    for (size_t k = 0; scattering_registry()[k] != NULL; k++) {
        const struct scattering_model *m = scattering_registry()[k];
        const struct balance most = stated_balance(m);
        double param[SCATTERING_MAX_PARAM], lost[2] = {0, 0}, gained[2] = {0, 0};
        struct scattering_state *s = NULL;
        struct error err = {0};
        clear_fiber(m, param);
        if (m->prepare(param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
        for (int side = 0; side < 2; side++)
            for (int a = 0; a < 5; a += is_long_variant() ? 1 : 2) {
                double sum[3];
                model_furnace(m, s, &q, 20 * a * RAD_PER_DEG, side == 0, sum);
                const double clear = 2 * sum[0] - sum[1];
                lost[side] = fmax(lost[side], 1 - clear);
                gained[side] = fmax(gained[side], clear - 1);
            }
        m->release(s);
        print_message("%s: in -%.4f +%.4f, out -%.4f +%.4f\n", m->id, lost[0], gained[0], lost[1], gained[1]);
        for (int side = 0; side < 2; side++)
            if (!(lost[side] < most.loss[side] && gained[side] < most.gain[side]))
                fail_msg("%s, %s: loses %.4f and gains %.4f, stated are %g and %g", m->id, side == 0 ? "in" : "out",
                         lost[side], gained[side], most.loss[side], most.gain[side]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_model_gains_energy),
                                       cmocka_unit_test(both_sides_keep_what_is_stated)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
