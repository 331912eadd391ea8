#include "base/angle.h"
#include "optimizer/report/page_charts.h"
#include "optimizer/report/page_text.h"
#include "optimizer/report/result/profile_report.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_CHART = 8, LEAST_ROW = 4 };

/* Rows in the order of theta_i, theta_o, phi_i and phi. */
static int compare_rows(const void *a, const void *b)
{
    const struct profile_row *x = *(const struct profile_row *const *)a, *y = *(const struct profile_row *const *)b;
    const double by[4] = {x->theta_i_rad - y->theta_i_rad, x->theta_o_rad - y->theta_o_rad, x->phi_i_rad - y->phi_i_rad,
                          x->phi_rad - y->phi_rad};
    for (int k = 0; k < 4; k++)
        if (by[k] < 0.0 || by[k] > 0.0) return by[k] < 0.0 ? -1 : 1;
    return 0;
}

/* Rows of one theta_i, theta_o and phi_i: from row `first` of the sorted ones to before `end`. */
struct slice {
    size_t first, end;
};

static bool same_slice(const struct profile_row *a, const struct profile_row *b)
{
    return fabs(a->theta_i_rad - b->theta_i_rad) < 1e-6 && fabs(a->theta_o_rad - b->theta_o_rad) < 1e-6 &&
           fabs(a->phi_i_rad - b->phi_i_rad) < 1e-6;
}

static size_t find_slices(const struct profile_row *const *row, size_t n, struct slice *slice)
{
    size_t n_slice = 0;
    for (size_t i = 0; i < n;) {
        const size_t first = i;
        while (i < n && same_slice(row[first], row[i])) i++;
        if (i - first >= LEAST_ROW) slice[n_slice++] = (struct slice){first, i};
    }
    return n_slice;
}

static void chart(const struct report *report, size_t i_model, const struct profile_row *const *row,
                  const struct slice *s, FILE *out)
{
    const size_t n = s->end - s->first, n_channel = report->in.fiber->profile.n_channel;
    struct page_point *point = calloc(n * n_channel, sizeof *point);
    char title[120];
    if (point == NULL) return;
    for (size_t k = 0; k < n * n_channel; k++) {
        const struct profile_row *r = row[s->first + k % n];
        const size_t channel = k / n, at = (size_t)(r - report->in.fiber->profile.row) * n_channel + channel;
        point[k] = (struct page_point){.x = angle_to_deg(r->phi_rad),
                                       .measured = r->radiance[channel],
                                       .se = r->se[channel],
                                       .fitted = report->model[i_model].fit->profile.value[at]};
    }
    int used = snprintf(title, sizeof title, "phi, degrees, at theta_i %.4g, theta_o %.4g",
                        angle_to_deg(row[s->first]->theta_i_rad), angle_to_deg(row[s->first]->theta_o_rad));
    if (report->in.fiber->profile.has_phi_i)
        used +=
            snprintf(title + used, sizeof title - (size_t)used, ", phi_i %.4g", angle_to_deg(row[s->first]->phi_i_rad));
    snprintf(title + used, sizeof title - (size_t)used, " degrees");
    page_measured_and_fitted(title, point, n, n_channel, out);
    free(point);
}

void profile_charts(const struct report *report, size_t i_model, size_t most, FILE *out)
{
    const struct fiber_profile *p = &report->in.fiber->profile;
    const struct profile_row **row = calloc(p->n + 1, sizeof *row);
    struct slice *slice = calloc(p->n + 1, sizeof *slice);
    if (row != NULL && slice != NULL) {
        for (size_t i = 0; i < p->n; i++) row[i] = &p->row[i];
        qsort(row, p->n, sizeof *row, compare_rows);
        const size_t n = find_slices(row, p->n, slice), n_shown = n < most ? n : most;
        fputs("<p class=\"hint\">Dots: measured, with stated errors; lines: fitted.</p>\n<div class=\"charts\">\n",
              out);
        for (size_t k = 0; k < n_shown; k++)
            chart(report, i_model, row, &slice[n_shown > 1 ? k * (n - 1) / (n_shown - 1) : 0], out);
        fputs("</div>\n", out);
    }
    free(row);
    free(slice);
}

void profile_page(const struct report *report, size_t i, FILE *out)
{
    const struct profile_fit *f = &report->model[i].fit->profile;
    fputs("<table>\n", out);
    if (isfinite(f->nrmse))
        fprintf(out, "<tr><td>residual, of the range of the radiances</td><td>%.2f %%</td></tr>\n", 100.0 * f->nrmse);
    fprintf(out, "<tr><td>residual relative to the radiance, or to 2 %% of the brightest</td><td>%.2f %%</td></tr>\n",
            100.0 * f->rel_rms);
    fprintf(out, "<tr><td>misfit that the weights contain, beyond stated errors</td><td>%.2f %%</td></tr>\n",
            100.0 * f->misfit);
    if (isfinite(f->chi_square))
        fprintf(out, "<tr><td>squared residuals over stated variances</td><td>%.3g</td></tr>\n", f->chi_square);
    fprintf(out, "<tr><td>scale</td><td>%.5g%s</td></tr>\n", f->scale, f->scale_se > 0.0 ? "" : ", as stated");
    if (f->has_turn)
        fprintf(out, "<tr><td>turn of the section</td><td>%.4g%s degrees</td></tr>\n", angle_to_deg(f->turn_rad),
                f->turn_determined ? "" : " (not determined)");
    fprintf(out, "<tr><td>starts that came to this result</td><td>%zu of %zu</td></tr>\n</table>\n", f->n_agree,
            f->n_start);
    profile_charts(report, i, MOST_CHART, out);
}
