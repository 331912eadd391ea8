#include "optimizer/fit/objective/product_noise.h"

#include <math.h>

void product_noise_add(struct product_noise *n, const double residual[2], const double variance[2])
{
    n->first[0] += residual[0] * sqrt(variance[1]);
    n->first[1] += residual[1] * sqrt(variance[0]);
    n->second += sqrt(variance[0] * variance[1]);
}

double product_noise_covariance(const struct product_noise *i, const struct product_noise *j, double correlation)
{
    double first = i->first[0] * j->first[0] + i->first[1] * j->first[1];
    return correlation * first - correlation * correlation * i->second * j->second;
}
