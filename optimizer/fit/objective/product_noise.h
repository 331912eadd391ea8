/* Noise of the product (A - M)(B - M) of one row, A and B being replicas, where rows share their camera paths
 * (estimate.partner). With residuals r and noises e of a replica,
 *   Cov[(r_i + eA_i)(r_i + eB_i), (r_j + eA_j)(r_j + eB_j)] = r_i r_j (cov_A + cov_B) + cov_A cov_B,
 * estimated without bias by a_i a_j cov_B + b_i b_j cov_A - cov_A cov_B with a = A - M, since E a_i a_j = r_i r_j +
 * cov_A. Covariances are the correlation of both rows times their standard deviations, in all channels alike. */
#ifndef SELVEDGE_OPTIMIZER_PRODUCT_NOISE_H
#define SELVEDGE_OPTIMIZER_PRODUCT_NOISE_H

struct product_noise {
    double first[2]; /* sums over channels of a sd_B and b sd_A */
    double second;   /* sum over channels of sd_A sd_B */
};

/* Adds one channel: residuals and variances of both replicas. */
void product_noise_add(struct product_noise *n, const double residual[2], const double variance[2]);
/* Covariance of the products of two rows. */
double product_noise_covariance(const struct product_noise *i, const struct product_noise *j, double correlation);

#endif
