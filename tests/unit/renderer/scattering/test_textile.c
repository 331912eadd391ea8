/* textile.v3 where it is known in closed form: the energy of R, and the flat section. test_scattering.c has what all
 * models share. */
#include "renderer/scattering/scattering.h"

#include "base/angle.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/support/model/prepared_model.h"

/* The energy of R at C_R and C_TT near 0 is rho alone: near th = 0, for a narrow lobe, the mean over azimuth of
 * (1 - cos(ph/2))^5 under N. Both means are integrals over half an azimuth, made here by quadrature. */
static void textile_rise_in_closed_form(void **unused)
{
    (void)unused;
    const struct scattering_model *m = scattering_find("textile.v3");
    enum { N_THETA = 4000, N_PHI = 200 };
    for (int k = 0; k < 2; k++) {
        double s = k == 0 ? 0.02 : 0.98, want = 0, got = 0, c_r = 0.001;
        const double param[13] = {c_r, c_r, c_r, 0.001, 0.001, 0.001, 1 * RAD_PER_DEG, 0.3, 0.4, 0.3, s, 0.5, 0.7};
        struct scattering_state *state = prepare(m, param);
        for (int j = 0; j < N_PHI; j++) {
            double phi = 2 * M_PI * (j + 0.5) / N_PHI - M_PI, c = cos(phi / 2);
            want += ((1 - s) / (2 * M_PI) + s * c / 4) * pow(1 - c, 5) * 2 * M_PI / N_PHI;
            for (int i = 0; i < N_THETA; i++) {
                double theta = 0.2 * ((i + 0.5) / N_THETA - 0.5);
                float wi[3] = {0, 1, 0}, rgb[3];
                float wo[3] = {(float)sin(theta), (float)(cos(theta) * cos(phi)), (float)(cos(theta) * sin(phi))};
                m->eval(state, wi, wo, rgb, NULL);
                got += (double)rgb[0] * cos(theta) * cos(theta) * 0.2 / N_THETA * 2 * M_PI / N_PHI;
            }
        }
        m->release(state);
        /* TT and D return at most C_TT = 0.001 */
        assert_true(fabs(got - (c_r + (1 - c_r) * want) - 5e-4) < 5e-4);
    }
}

/* Energy that leaves towards all directions for light from wi, without R; channel 0. */
static double energy_from(const struct scattering_model *m, const struct scattering_state *state, const float wi[3])
{
    enum { N_THETA = 300, N_PHI = 600 };
    double sum = 0;
    for (int i = 0; i < N_THETA; i++)
        for (int j = 0; j < N_PHI; j++) {
            double theta = M_PI * ((i + 0.5) / N_THETA - 0.5), phi = 2 * M_PI * (j + 0.5) / N_PHI;
            float wo[3] = {(float)sin(theta), (float)(cos(theta) * cos(phi)), (float)(cos(theta) * sin(phi))}, rgb[3];
            m->eval(state, wi, wo, rgb, NULL);
            sum += (double)rgb[0] * cos(theta) * cos(theta) * M_PI / N_THETA * 2 * M_PI / N_PHI;
        }
    return sum;
}

/* A flat section: all light leaves it, from whatever azimuth it comes (C_TT = 0.999). Back towards the light and off
 * R's cone there is only D, which is w v(ph)^2 / (mean of v) times what a round section has: 1 / (mean of v) seen from
 * the flat side, and f^2 of that from the edge. */
static void flat_section_in_closed_form(void **unused)
{
    (void)unused;
    const struct scattering_model *m = scattering_find("textile.v3");
    double mean_v[2] = {0, 0}, back[2][2];
    static const double f[2] = {0.3, 0.98};
    for (int n = 0; n < 2; n++) {
        const double param[13] = {0.001, 0.001, 0.001, 0.999, 0.999, 0.999, 5 * RAD_PER_DEG, 0.2, 10 * RAD_PER_DEG,
                                  0.8,   0.5,   f[n],  0.9};
        struct scattering_state *state = prepare(m, param);
        for (int i = 0; i < 1000; i++)
            mean_v[n] += sqrt(f[n] * f[n] + (1 - f[n] * f[n]) * pow(cos((i + 0.5) / 1000 * M_PI_2), 2)) / 1000;
        for (int i = 0; i <= 6; i++) {
            double psi = i * M_PI / 12, theta = 0.3;
            const float wi[3] = {(float)sin(theta), (float)(cos(theta) * cos(psi)), (float)(cos(theta) * sin(psi))};
            double energy = energy_from(m, state, wi);
            if (fabs(energy - 0.999) > 1e-3) fail_msg("azimuth %d deg: %.5f", 15 * i, energy);
        }
        for (int k = 0; k < 2; k++) {
            const float wi[3] = {0.5f, k == 0 ? sqrtf(0.75f) : 0, k == 0 ? 0 : sqrtf(0.75f)},
                        wo[3] = {0.2f, wi[1], wi[2]};
            float rgb[3];
            m->eval(state, wi, wo, rgb, NULL);
            back[n][k] = (double)rgb[0];
        }
        m->release(state);
        assert_true(fabs(back[n][1] / back[n][0] / (f[n] * f[n]) - 1) < 1e-4);
    }
    assert_true(fabs(back[0][0] / back[1][0] / (mean_v[1] / mean_v[0]) - 1) < 1e-4);
}

/* D alone, off R's cone and away from TT: towards the light and beside it, at azimuths where a flat section looks the
 * same. */
static void side_in_closed_form(void **unused)
{
    (void)unused;
    const struct scattering_model *m = scattering_find("textile.v3");
    static const double azimuth[2] = {0, M_PI_2}, h[3] = {0.02, 0.5, 0.9};
    for (int n = 0; n < 3; n++) {
        const double param[13] = {0.001, 0.001,           0.001, 0.9, 0.9, 0.9, 2 * RAD_PER_DEG,
                                  0.2,   5 * RAD_PER_DEG, 0.9,   0.5, 0.3, h[n]};
        struct scattering_state *state = prepare(m, param);
        const float wi[3] = {0.5f, sqrtf(0.375f), sqrtf(0.375f)};
        float rgb[2][3];
        for (int k = 0; k < 2; k++) {
            double phi = M_PI_4 + azimuth[k], c = sqrt(1 - 0.04);
            const float wo[3] = {0.2f, (float)(c * cos(phi)), (float)(c * sin(phi))};
            m->eval(state, wi, wo, rgb[k], NULL);
        }
        m->release(state);
        assert_true(fabs((double)(rgb[0][0] / rgb[1][0]) - (1 - (2 * h[n] - 1))) < 1e-4);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(textile_rise_in_closed_form),
        cmocka_unit_test(flat_section_in_closed_form),
        cmocka_unit_test(side_in_closed_form),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
