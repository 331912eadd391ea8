#include "geometry/weave/weave_detect.h"

#include <stdio.h>

static bool on_top(const struct weave_draft *d, size_t i, size_t j)
{
    return d->warp_on_top[j % d->n_weft * d->n_warp + i % d->n_warp] != 0;
}

/* The shift down from warp 0 to warp 1 that maps one to the other, if the same shift maps each warp to the next; 0 if
 * there is none. */
static size_t step_of(const struct weave_draft *d)
{
    for (size_t step = 1; step < d->n_weft; step++) {
        bool holds = true;
        for (size_t i = 0; holds && i < d->n_warp; i++)
            for (size_t j = 0; holds && j < d->n_weft; j++) holds = on_top(d, i + 1, j + step) == on_top(d, i, j);
        if (holds) return step;
    }
    return 0;
}

/* Returns whether the draft is a plain one with every yarn repeated n times: 2 in basket 2/2. */
static bool is_basket(const struct weave_draft *d, size_t n)
{
    if (d->n_warp != 2 * n || d->n_weft != 2 * n) return false;
    for (size_t by = 0; by < n; by++)
        for (size_t bx = 0; bx < n; bx++) {
            bool holds = true;
            for (size_t j = 0; holds && j < 2 * n; j++)
                for (size_t i = 0; holds && i < 2 * n; i++)
                    holds = on_top(d, bx + i, by + j) == (((i / n + j / n) % 2 == 0) == on_top(d, bx, by));
            if (holds) return true;
        }
    return false;
}

void weave_draft_name(const struct weave_draft *d, char *name, size_t n)
{
    size_t step = step_of(d), up = 0, n_end = 0;
    for (size_t j = 0; j < d->n_weft; j++) {
        up += on_top(d, 0, j);
        n_end += on_top(d, 0, j) != on_top(d, 0, j + 1);
    }
    bool square = d->n_warp == d->n_weft, one_float = n_end == 2;
    if (square && d->n_warp == 2)
        snprintf(name, n, "plain");
    else if (is_basket(d, 2))
        snprintf(name, n, "basket 2/2");
    else if (square && one_float && (step == 1 || step + 1 == d->n_weft))
        snprintf(name, n, "twill %zu/%zu", up, d->n_weft - up);
    else if (square && one_float && step > 1 && (up == 1 || up + 1 == d->n_weft))
        snprintf(name, n, "satin %zu", d->n_weft);
    else
        snprintf(name, n, "draft");
}
