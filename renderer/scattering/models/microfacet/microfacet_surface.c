#include "renderer/scattering/models/microfacet/microfacet_surface.h"

/* Nodes of Gauss's rule over [-1, 1] that are at least 0, and their weights. */
enum { N_GAUSS = 8 };
static const double gauss_node[N_GAUSS] = {0.0950125098376374, 0.2816035507792589, 0.4580167776572274,
                                           0.6178762444026438, 0.7554044083550030, 0.8656312023878318,
                                           0.9445750230732326, 0.9894009349916499};
static const double gauss_weight[N_GAUSS] = {0.1894506104550685, 0.1826034150449236, 0.1691565193950025,
                                             0.1495959888165767, 0.1246289712555339, 0.0951585116824928,
                                             0.0622535239386479, 0.0271524594117541};

#define REACH 4.5 /* slopes over r beyond which facets do not count */

/* Area that hidden facets have for one that is seen, Smith's Lambda for slopes of Beckmann's distribution. */
static double hidden(double cosine, double roughness)
{
    const double a = cosine / (roughness * sqrt(fmax(1 - cosine * cosine, 1e-12)));
    return a > 5 ? 0 : 0.5 * (exp(-a * a) / (a * sqrt(M_PI)) - erfc(a));
}

/* Integral over t = tan psi of exp(-t^2 / r^2) (1 + t^2) / (1 + Lambda) over that without Lambda. The direction is seen
 * from where cos(psi + alpha) > 0. */
double microfacet_seen(double cos_theta, double cos_alpha, double roughness)
{
    const double r = roughness, sin_alpha = sqrt(fmax(1 - cos_alpha * cos_alpha, 0));
    const double limb = cos_alpha / fmax(sin_alpha, 1e-9), start = -REACH * r, end = fmin(REACH * r, limb);
    double sum = 0;
    if (end <= start) return 0;
    for (int i = 0; i < 2 * N_GAUSS; i++) {
        const double node = i < N_GAUSS ? gauss_node[i] : -gauss_node[i - N_GAUSS];
        const double t = start + 0.5 * (end - start) * (1 + node);
        const double cosine = cos_theta * (cos_alpha - t * sin_alpha) / sqrt(1 + t * t);
        if (!(cosine > 0)) continue;
        sum += gauss_weight[i % N_GAUSS] * exp(-t * t / (r * r)) * (1 + t * t) / (1 + hidden(cosine, r));
    }
    return 0.5 * (end - start) * sum / (sqrt(M_PI) * r * (1 + 0.5 * r * r));
}

/* The x at which tan th_h = t, of two directions whose difference angle has this cosine: sin^2(x / 2) = t^2 c^2 / (1 -
 * t^2 (sin^2 th_d - c^2) / cos^2 th_d), c = cos(ph / 2). At most where one direction is along the fiber. */
static double off_of(double t, double cos_theta, double c2)
{
    const double most = M_PI - 2 * acos(fmin(cos_theta, 1)), cos2 = cos_theta * cos_theta;
    const double below = 1 - t * t * (1 - cos2 - c2) / cos2, u = below > 0 ? t * t * c2 / below : 1;
    return u >= 1 ? most : fmin(2 * asin(sqrt(u)), most);
}

void microfacet_reflected_lobe(const struct microfacet_surface *s, double cos_theta, double phi, float *shift,
                               float *width)
{
    static const double node[7] = {-2.6519613568, -1.6735516288, -0.8162878829, 0,
                                   0.8162878829,  1.6735516288,  2.6519613568}; /* of Gauss and Hermite */
    static const double weight[7] = {9.7178124510e-4, 5.4515582819e-2, 4.2560725261e-1, 8.1026461756e-1,
                                     4.2560725261e-1, 5.4515582819e-2, 9.7178124510e-4};
    const double c = cos(0.5 * phi), center = off_of((double)s->tilt, cos_theta, c * c);
    double sum = 0, spread = 0;
    for (int i = 0; i < 7; i++) {
        const double t = (double)s->tilt + (double)s->roughness * node[i];
        sum += weight[i];
        spread += weight[i] * pow(copysign(off_of(t, cos_theta, c * c), t) - center, 2);
    }
    *shift = (float)center;
    *width = (float)fmax(1.1 * sqrt(spread / sum), 1e-3);
}
