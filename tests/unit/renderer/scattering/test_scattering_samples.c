/* How often a model draws from each of its terms: samples that ask for the wrong term cost variance, which no mean
 * shows. */
#include "renderer/scattering/scattering.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

/* Integral over all directions wi of the model's S cos th_i, or of cos th_i (1 - (1 - cos th_i)^5) / pi^2 without a
 * model, by midpoints in the sine of theta and in phi. */
static double over_all_directions(const struct scattering_model *m, const struct scattering_state *s, const float wo[3])
{
    enum { N = 160 };
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double z = (2 * i + 1.0) / N - 1, phi = 2 * M_PI * (j + 0.5) / N, c = sqrt(1 - z * z);
            float rgb[3], wi[3] = {(float)z, (float)(c * cos(phi)), (float)(c * sin(phi))};
            if (m != NULL) m->eval(s, wi, wo, rgb, NULL);
            sum += (m != NULL ? (double)rgb[1] : (1 - pow(1 - c, 5)) / (M_PI * M_PI)) * c * 4 * M_PI / (N * N);
        }
    return sum;
}

/* two_lobe_diffuse.v1 draws from the uniform term as often as its share of the light of grey fibers asks for. The draw
 * u = (x, 0, 0) of that term has the sine sqrt(x / p), which says p. */
static void diffuse_share_of_samples(void **unused)
{
    (void)unused;
    const struct scattering_model *m = scattering_find("two_lobe_diffuse.v1");
    const float wo[3] = {0.2f, 0.5f, 0.8426150f}, u[3] = {0.01f, 0, 0};
    double param[SCATTERING_MAX_PARAM], uniform = over_all_directions(NULL, NULL, wo);
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    for (size_t c = 0; c < 3; c++) {
        param[c] = 0.1;
        param[3 + c] = 0.5;
    }
    for (int k = 1; k < 9; k++) {
        double w = param[m->n_param - 1] = 0.1 * k;
        struct scattering_state *s = NULL;
        assert_int_equal(m->prepare(param, &s, NULL), STATUS_OK);
        double share = w * 0.5 * (1 - 0.1) * uniform / over_all_directions(m, s, wo);
        float wi[3];
        m->sample(s, wo, NULL, u, wi);
        double p = (double)(u[0] / (wi[0] * wi[0]));
        print_message("w %.1f: share of the uniform term %.3f, drawn %.3f\n", w, share, p);
        assert_true(fabs(p - share) < 0.03);
        m->release(s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(diffuse_share_of_samples)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
