#include "optimizer/report/textures/zeltner_sheen.h"

#include <math.h>

/* A Gaussian over the cosine, and a rest. */
double zeltner_sheen_albedo(double cosine, double roughness)
{
    const double y = roughness;
    const double width = y * (0.0206607 + 1.58491 * y) / (0.0379424 + y * (1.32227 + y));
    const double middle = y * (-0.193854 + y * (-1.14885 + y * (1.7932 - 0.95943 * y * y))) / (0.046391 + y);
    const double rest = y * (0.000654023 + (-0.0207818 + 0.119681 * y) * y) / (1.26264 + y * (-1.92021 + y));
    const double t = (cosine - middle) / width;
    return fmin(fmax(exp(-0.5 * t * t) / (width * sqrt(2.0 * M_PI)) + rest, 0.0), 1.0);
}

double zeltner_sheen_density(const double wi[3], const double wo[3], double roughness)
{
    const double x = fmin(fmax(wo[2], 1e-4), 1.0), y = roughness, across = hypot(wo[0], wo[1]);
    /* The inverse matrix that takes the lobe to a cosine has a, a and 1 on its diagonal, and b beside. */
    const double a = (2.58126 * x + 0.813703 * y) * y / (1.0 + 0.310327 * x * x + 2.60994 * x * y);
    const double b =
        sqrt(1.0 - x) * (y - 1.0) * y * y * y / (0.0000254053 + 1.71228 * x - 1.71506 * x * y + 1.34174 * y * y);
    const double c = across > 0.0 ? wo[0] / across : 1.0, s = across > 0.0 ? wo[1] / across : 0.0;
    const double along = c * wi[0] + s * wi[1], beside = c * wi[1] - s * wi[0];
    const double p = a * along + b * wi[2], q = a * beside, square = p * p + q * q + wi[2] * wi[2];
    return fmax(wi[2], 0.0) / M_PI * (a / square) * (a / square);
}
