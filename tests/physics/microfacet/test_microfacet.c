/* microfacet_ellipse.v1 against random walks through a fiber of facets, and its light from both sides. */
#include "base/angle.h"
#include "base/rng.h"
#include "renderer/scattering/models/microfacet/microfacet.h"
#include "tests/support/model/model_furnace.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/model/prepared_model.h"

/* ---- random walks, which share no code with the model ---- */

enum { N_BIN = 36, N_RAY = 1000000, N_ROW_TESTED = 18 };

/* Light that leaves at an azimuth, its square, and light times x^2, x = th_i + th_o. */
struct histogram {
    double sum[N_BIN], square[N_BIN], spread[N_BIN], spread_square[N_BIN];
};

/* The fiber of the test: ratio 1.3, area pi. */
static const double axes[2] = {1.140175425099138, 0.8770580193070293}, eta = 1.55, c_t = 0.5, roughness = 0.2;

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Snell's law for a ray d that meets a wall of normal n, which points to where it comes from, by the amplitudes of both
 * polarisations. Returns the reflectance. */
static double refract(const double d[3], const double n[3], double k, double out[3])
{
    const double c1 = -dot(d, n), square = 1 - k * k * (1 - c1 * c1);
    if (square <= 0) return 1;
    const double c2 = sqrt(square), rs = (k * c1 - c2) / (k * c1 + c2), rp = (c1 - k * c2) / (c1 + k * c2);
    for (int i = 0; i < 3; i++) out[i] = k * d[i] + (k * c1 - c2) * n[i];
    return 0.5 * (rs * rs + rp * rp);
}

static double normal_draw(struct rng *r)
{
    const double u = 1 - rng_double(r);
    return sqrt(-2 * log(u)) * cos(2 * M_PI * rng_double(r));
}

/* Draws the facet that the direction w sees, by rejection: in proportion to the area that it shows. The normal of the
 * wall is outward. */
static void draw_facet(struct rng *r, const double at[2], const double w[3], double n[3], double m[3])
{
    const double v = at[0] / (axes[0] * axes[0]), u = at[1] / (axes[1] * axes[1]), size = hypot(v, u);
    n[0] = 0;
    n[1] = v / size;
    n[2] = u / size;
    const double around = -n[2] * w[1] + n[1] * w[2], most = dot(w, n) + 6 * roughness * M_SQRT1_2;
    for (;;) {
        const double p = roughness * M_SQRT1_2 * normal_draw(r), q = roughness * M_SQRT1_2 * normal_draw(r);
        const double shown = p * w[0] + q * around + dot(w, n), length = sqrt(1 + p * p + q * q);
        if (most * rng_double(r) >= shown) continue;
        m[0] = p / length;
        m[1] = (n[1] - q * n[2]) / length;
        m[2] = (n[2] + q * n[1]) / length;
        return;
    }
}

static void add(struct histogram *h, double power, const double out[3], double phi, double theta)
{
    const double turn = (atan2(out[2], out[1]) - phi) / (2 * M_PI), x = asin(fmax(-1, fmin(1, out[0]))) + theta;
    const int half = (int)((turn - floor(turn)) * 2 * N_BIN) % (2 * N_BIN),
              bin = half < N_BIN ? half : 2 * N_BIN - 1 - half;
    h->sum[bin] += power;
    h->square[bin] += power * power;
    h->spread[bin] += power * x * x;
    h->spread_square[bin] += pow(power * x * x, 2);
}

static double lambda(double cosine)
{
    const double a = cosine / (roughness * sqrt(1 - cosine * cosine));
    return 0.5 * (exp(-a * a) / (a * sqrt(M_PI)) - erfc(a));
}

/* R, TT and TRT of one ray. */
static void walk(struct rng *r, double theta, struct histogram h[3])
{
    const double phi = 2 * M_PI * rng_double(r), place = 2 * rng_double(r) - 1;
    const double half = hypot(axes[0] * sin(phi), axes[1] * cos(phi)), s = place * half;
    const double w[3] = {sin(theta), cos(theta) * cos(phi), cos(theta) * sin(phi)};
    /* first point of the section on the line through s (-sin phi, cos phi) along (cos phi, sin phi) */
    const double a = pow(cos(phi) / axes[0], 2) + pow(sin(phi) / axes[1], 2);
    const double b = s * sin(phi) * cos(phi) * (1 / (axes[1] * axes[1]) - 1 / (axes[0] * axes[0]));
    const double c = s * s * (pow(sin(phi) / axes[0], 2) + pow(cos(phi) / axes[1], 2)) - 1;
    const double t = (-b + sqrt(fmax(b * b - a * c, 0))) / a;
    double at[2] = {-s * sin(phi) + t * cos(phi), s * cos(phi) + t * sin(phi)}, n[3], m[3], d[3], in[3], out[3];
    draw_facet(r, at, w, n, m);
    for (int i = 0; i < 3; i++) d[i] = -w[i];
    double f = refract(d, m, 1 / eta, in), left = half * (1 - f);
    for (int i = 0; i < 3; i++) out[i] = d[i] + 2 * dot(w, m) * m[i];
    if (dot(out, n) > 0)
        add(&h[0], half * f * (1 + lambda(dot(w, n))) / (1 + lambda(dot(w, n)) + lambda(dot(out, n))), out, phi, theta);
    for (int p = 1; p < 3; p++) {
        const double q[2] = {in[1] / axes[0], in[2] / axes[1]}, o[2] = {at[0] / axes[0], at[1] / axes[1]};
        const double way = fmax(-2 * (q[0] * o[0] + q[1] * o[1]) / (q[0] * q[0] + q[1] * q[1]), 0);
        at[0] += way * in[1];
        at[1] += way * in[2];
        left *= pow(c_t, 0.5 * way);
        draw_facet(r, at, in, n, m);
        double inward[3] = {-m[0], -m[1], -m[2]};
        f = refract(in, inward, eta, out);
        if (f < 1) add(&h[p], left * (1 - f), out, phi, theta);
        left *= f;
        const double along = dot(in, m);
        for (int i = 0; i < 3; i++) in[i] -= 2 * along * m[i];
    }
}

/* Light of R that leaves at an azimuth, and times x^2: closed form over x. */
static void reflected(const struct scattering_state *s, double theta, double phi, double light[2])
{
    enum { N = 600 };
    const double width = M_PI / N;
    const float wi[3] = {(float)sin(theta), (float)cos(theta), 0};
    light[0] = light[1] = 0;
    for (int i = 0; i < N; i++) {
        const double to = -M_PI_2 + (i + 0.5) * width, c = cos(to);
        const float wo[3] = {(float)sin(to), (float)(c * cos(phi)), (float)(c * sin(phi))};
        float d;
        const struct microfacet_half h = microfacet_half_of(wi, wo);
        const double seen = (double)microfacet_seen_at(&s->row[N_ROW_TESTED], 0, h.cos_alpha, &d);
        /* S cos^2 th_o, S = R / (cos th_i cos th_o) */
        const double r =
            seen * (double)microfacet_reflected(&s->surface, h.t, h.cos_half, NULL) * c / cos(theta) * width;
        light[0] += r;
        light[1] += r * pow(to + theta, 2);
    }
}

/* N and N sigma^2 of a lobe at an azimuth. */
static void inner(const struct scattering_state *s, int p, double phi, double light[2])
{
    const double column = phi * MICROFACET_N_PHI / M_PI;
    const int j = (int)fmin(column, MICROFACET_N_PHI - 1);
    const double y = column - j;
    const struct microfacet_cell *a = &s->cell[N_ROW_TESTED][j], *b = a + 1;
    const double width = (1 - y) * (double)a->width[p] + y * (double)b->width[p];
    light[0] = (1 - y) * (double)a->n[p][1] + y * (double)b->n[p][1];
    light[1] = light[0] * width * width;
}

/* Light of R, TT and TRT and its second moment along the fiber, at a row of the tables: summed over azimuths within 4
 * standard errors and 2 % (light) or 10 % (moment), and in each bin within 4 standard errors and 12 % of the peak. The
 * lattice has 2039 paths, of which a bin of TT gets a few dozen of each corner; tables are linear between nodes of the
 * grid of parameters, and the moment takes absorption to be the same at all x. */
static void walks_in_space(void **state)
{
    (void)state;
    static struct histogram h[3];
    static const char *const name[3] = {"R", "TT", "TRT"};
    enum { SUB = 4 };
    const double param[7] = {0.9, c_t, 0.1, eta, axes[0] / axes[1], roughness, 0.1 * RAD_PER_DEG};
    const double theta = acos((double)N_ROW_TESTED / MICROFACET_N_ROW), bin_rad = M_PI / N_BIN;
    struct scattering_state *s = prepare(scattering_find("microfacet_ellipse.v1"), param);
    struct rng r;
    double widths = 0;
    rng_start(&r, &(struct rng_key){71, 0, 0, 0}, 0, 0);
    for (long i = 0; i < N_RAY; i++) walk(&r, theta, h);
    enum { N_TURN = 4096 };
    for (int i = 0; i < N_TURN; i++)
        widths += hypot(axes[0] * sin(2 * M_PI * i / N_TURN), axes[1] * cos(2 * M_PI * i / N_TURN)) / N_TURN;
    const double scale = 1 / (N_RAY * widths * 2 * bin_rad);
    for (int p = 0; p < 3; p++) {
        double top[2] = {0, 0}, off[2] = {0, 0}, noise[2] = {0, 0}, all[2] = {0, 0}, walked[2] = {0, 0},
               square[2] = {0, 0};
        for (int j = 0; j < N_BIN; j++) {
            top[0] = fmax(top[0], h[p].sum[j] * scale);
            top[1] = fmax(top[1], h[p].spread[j] * scale);
        }
        for (int j = 0; j < N_BIN; j++) {
            double light[2] = {0, 0};
            for (int k = 0; k < SUB; k++) {
                double one[2];
                const double phi = (j + (k + 0.5) / SUB) * bin_rad;
                if (p == 0)
                    reflected(s, theta, phi, one);
                else
                    inner(s, p - 1, phi, one);
                for (int q = 0; q < 2; q++) light[q] += one[q] / SUB;
            }
            const double want[2] = {h[p].sum[j] * scale, h[p].spread[j] * scale},
                         se[2] = {sqrt(h[p].square[j]) * scale, sqrt(h[p].spread_square[j]) * scale};
            for (int q = 0; q < 2; q++) {
                all[q] += light[q];
                walked[q] += want[q];
                square[q] += se[q] * se[q];
                off[q] = fmax(off[q], fabs(light[q] - want[q]) / top[q]);
                noise[q] = fmax(noise[q], se[q] / top[q]);
                if (q == 0 && fabs(light[q] - want[q]) > 4 * se[q] + 0.12 * top[q])
                    fail_msg("%s, bin %d: %.5f instead of %.5f +- %.5f (largest %.5f)", name[p], j, light[q], want[q],
                             se[q], top[q]);
            }
        }
        print_message(
            "%-3s light off by %.4f +- %.4f, in a bin by at most %.4f of the peak (noise %.4f); second moment "
            "off by %.4f +- %.4f\n",
            name[p], all[0] / walked[0] - 1, sqrt(square[0]) / walked[0], off[0], noise[0], all[1] / walked[1] - 1,
            sqrt(square[1]) / walked[1]);
        for (int q = 0; q < 2; q++)
            assert_true(fabs(all[q] - walked[q]) < 4 * sqrt(square[q]) + (q == 0 ? 0.02 : 0.1) * walked[q]);
    }
    scattering_find("microfacet_ellipse.v1")->release(s);
}

/* Integral of S cos th over all directions of one side, extrapolated to C_T = 1 from two values: 1. */
static void lossless_from_both_sides(void **state)
{
    (void)state;
    const struct scattering_model *m = scattering_find("microfacet_ellipse.v1");
    static const double set[4][4] = {{1.55, 1.3, 0.2, 3}, {1.3, 1, 0.08, 0.1}, {1.8, 2.5, 0.6, 10}, {1.45, 2, 0.35, 6}};
    static const double theta_deg[5] = {0, -30, 60, 80, -89};
    const struct model_furnace q = {.n_theta = 720, .n_phi = 180};
    double worst = 0;
    for (int k = 0; k < 4; k++) {
        const double param[7] = {0.999, 0.998, 0.5, set[k][0], set[k][1], set[k][2], set[k][3] * RAD_PER_DEG};
        struct scattering_state *s = prepare(m, param);
        for (int t = 0; t < 5; t++)
            for (int side = 0; side < 2; side++) {
                double sum[3];
                model_furnace(m, s, &q, theta_deg[t] * RAD_PER_DEG, side == 0, sum);
                const double clear = 2 * sum[0] - sum[1];
                if (fabs(theta_deg[t]) < 85) worst = fmax(worst, fabs(clear - 1));
                if (!(fabs(clear - 1) < (fabs(theta_deg[t]) > 85 ? 5e-3 : 1e-3)))
                    fail_msg("set %d, side %d, %g degrees: %.5f", k, side, theta_deg[t], clear);
            }
        m->release(s);
    }
    print_message("off by at most %.5f up to 80 degrees\n", worst);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(walks_in_space), cmocka_unit_test(lossless_from_both_sides)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
