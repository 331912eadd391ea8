/* Charts of the report as SVG in the page. */
#ifndef SELVEDGE_OPTIMIZER_PAGE_CHARTS_H
#define SELVEDGE_OPTIMIZER_PAGE_CHARTS_H

#include <jansson.h>
#include <stdio.h>

/* rows: the rows of result.json. Rendered over measured mean radiance, logarithmic, channels in their colors, held-out
 * rows as rings. */
void page_scatter(const json_t *rows, FILE *out);
/* Relative error of the rows, in per cent, over one of their angles. */
void page_errors_over(const json_t *rows, const char *angle_key, const char *title, FILE *out);
/* Points of one channel after the other, n of each, in the order of x: dots with bars of one standard error where it is
 * stated, and a line through the fitted values. */
struct page_point {
    double x, measured, se, fitted;
};
void page_measured_and_fitted(const char *x_label, const struct page_point *point, size_t n, size_t n_channel,
                              FILE *out);
/* curve: [{"step", "objective", "objective_se"}], of one model: the objective over the steps, logarithmic where it is
 * above its noise. */
void page_curve(const json_t *curve, FILE *out);
/* The correlation matrix as colored cells, with the names of the parameters. */
void page_correlation(const json_t *parameters, const json_t *matrix, FILE *out);

#endif
