/* How far two pictures of the same cloth are apart, over square fields of pixels. */
#ifndef SELVEDGE_BENCH_FIELD_COMPARISON_H
#define SELVEDGE_BENCH_FIELD_COMPARISON_H

#include "renderer/image/image.h"

/* Sums over n pairs of field and channel, of fields that show cloth in either picture. */
struct field_comparison {
    double mean;       /* of the first picture */
    double difference; /* of the second less the first */
    double error2;     /* of the squares of these differences */
    double noise2[2];  /* of the variances of the fields' means, of each picture */
    double square2;    /* of the squares of what each field adds to error2 less noise2, all channels in one */
    double n;
};

/* first, second: of one size, with the variances of their pixels after red, green and blue
 * (renderer/transport/render.h). edge: pixels along a field; what is left at the right and below counts for nothing.
 */
struct field_comparison field_comparison_of(const struct image *first, const struct image *second, size_t edge);
/* Root mean square of the differences over the mean, without what the noise of both adds. */
double field_comparison_stays(const struct field_comparison *r);
/* Standard error of the square of that, from how it varies between fields: a few bright paths make noise that pictures
 * with tens of paths a pixel do not tell from an error of some percent. */
double field_comparison_square_se(const struct field_comparison *r);

#endif
