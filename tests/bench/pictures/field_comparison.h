/* How far two pictures of the same cloth are apart, over square fields of them, and what follows for the time that
 * each takes to a given error. */
#ifndef SELVEDGE_BENCH_FIELD_COMPARISON_H
#define SELVEDGE_BENCH_FIELD_COMPARISON_H

#include <stdbool.h>
#include <stddef.h>

/* Sums over the n samples of one field, each channel: of their radiances, and of the squares of these. */
struct field_sum {
    double n, x[3], x2[3];
};

/* Sums over n pairs of field and channel, of lit fields: those whose mean radiance in both pictures is at least
 * FIELD_LIT of that of all fields. Background counts for nothing, nor does cloth in deep shadow, which would divide the
 * error by a smaller mean. "Not 0" is no criterion: rare paths light more fields the more samples there are. */
#define FIELD_LIT 0.01
struct field_comparison {
    double mean;       /* of the first picture */
    double difference; /* of the second less the first */
    double error2;     /* of the squares of these differences */
    double noise2[2];  /* of the variances of the fields' means, of each picture */
    double square2;    /* of the squares of what each field adds to error2 less noise2, all channels in one */
    double n;
};

/* The time that the first picture takes to an error over that of the second, of which a part does not fall with the
 * time. It is `value` for the estimated square of that part, and `least` for that square and two standard errors more.
 * Both are 0 where that part is shown to be above the error, and where neither is shown. */
struct field_speedup {
    enum { FIELD_SPEEDUP_SHOWN, FIELD_SPEEDUP_ABOVE, FIELD_SPEEDUP_NOT_RESOLVED } verdict;
    double value, least;
};

/* Each sum is of at least two samples. */
struct field_comparison field_comparison_of(const struct field_sum *first, const struct field_sum *second,
                                            size_t n_field);
/* Mean square of the differences over the squared mean radiance, without what the noise of both adds. Below 0 by
 * chance. Needs two lit fields. */
double field_comparison_square(const struct field_comparison *r);
/* Standard error of that, from how it varies between fields. */
double field_comparison_square_se(const struct field_comparison *r);
/* Relative noise of the fields' means of one picture, 0 or 1: root mean square. */
double field_comparison_noise(const struct field_comparison *r, size_t i_picture);

/* at_equal_noise: the time of the first picture over that of the second when both have the same noise. error: relative,
 * as the square. */
struct field_speedup field_speedup_of(double at_equal_noise, double square, double square_se, double error);
/* Whether more samples would say little more: the part that stays is shown to be above the error; or to be below it,
 * and its square is known to an eighth of the squared error. */
bool field_speedup_is_settled(double square, double square_se, double error);

#endif
