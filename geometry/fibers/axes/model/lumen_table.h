/* The blurred image of a lumen: of a disc of area A (its radius squared) under a Gaussian of standard deviation 1, at a
 * distance u from its center. A lumen is often narrower than the blur, so that no profile of an edge describes it.
 *
 *     D(u, A) = integral over t from 0 to sqrt A of t exp(-(t^2 + u^2) / 2) I0(t u),
 *
 * the distribution of Rice. A negative area has the negative image, so that the estimate of an area that is 0 has no
 * bias. */
#ifndef SELVEDGE_GEOMETRY_LUMEN_TABLE_H
#define SELVEDGE_GEOMETRY_LUMEN_TABLE_H

enum { LUMEN_N_RADIUS = 81, LUMEN_N_PLACE = 121, LUMEN_PER_UNIT = 10 };

struct lumen_image {
    float share, by_place, by_area; /* the last two: derivatives by u and A */
};

struct lumen_table {
    struct lumen_image entry[LUMEN_N_RADIUS][LUMEN_N_PLACE];
};

void lumen_table_init(struct lumen_table *t);
/* place: u, not negative. Discs wider than the table are looked at from their edge. */
struct lumen_image lumen_table_at(const struct lumen_table *t, float place, float area);

#endif
