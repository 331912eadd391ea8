#include "geometry/fibers/seam/assignment.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

/* A column that the search may visit next. Entries are not removed when a shorter way is found; outdated ones are
 * skipped when they come up. */
struct open_column {
    double distance;
    size_t column;
};

struct solver {
    const struct allowed_pair *pair;
    size_t *first; /* n_row + 1: pairs of each row */
    double alone;
    size_t *row_of, *from;   /* per column: its row and the row before it on the way to it; SIZE_MAX: none */
    double *dual, *distance; /* per column */
    double *paid;            /* per column: cost of its pair */
    size_t *touched;         /* columns with a finite distance */
    bool *done;              /* per column */
    size_t n_touched, n_open, capacity;
    struct open_column *open; /* a binary heap, the nearest first */
    size_t *partner;
};

static bool before(const struct open_column *a, const struct open_column *b)
{
    return a->distance != b->distance ? a->distance < b->distance : a->column < b->column;
}

static bool push(struct solver *s, double distance, size_t column)
{
    if (s->n_open == s->capacity) {
        size_t more = s->capacity == 0 ? 256 : 2 * s->capacity;
        struct open_column *bigger = realloc(s->open, more * sizeof *bigger);
        if (bigger == NULL) return false;
        s->open = bigger;
        s->capacity = more;
    }
    size_t i = s->n_open++;
    const struct open_column o = {distance, column};
    for (; i > 0 && before(&o, &s->open[(i - 1) / 2]); i = (i - 1) / 2) s->open[i] = s->open[(i - 1) / 2];
    s->open[i] = o;
    return true;
}

static struct open_column pop(struct solver *s)
{
    const struct open_column top = s->open[0], last = s->open[--s->n_open];
    size_t i = 0;
    for (size_t child = 1; child < s->n_open; i = child, child = 2 * i + 1) {
        if (child + 1 < s->n_open && before(&s->open[child + 1], &s->open[child])) child++;
        if (!before(&s->open[child], &last)) break;
        s->open[i] = s->open[child];
    }
    s->open[i] = last;
    return top;
}

/* Offers the columns of a row that is reached at `distance`, relative to the dual of the row. */
static bool reach_row(struct solver *s, size_t row, double distance)
{
    for (size_t e = s->first[row]; e < s->first[row + 1]; e++) {
        const size_t j = s->pair[e].column;
        const double d = distance + s->pair[e].cost - s->dual[j];
        if (s->done[j] || d >= s->distance[j]) continue;
        if (isinf(s->distance[j])) s->touched[s->n_touched++] = j;
        s->distance[j] = d;
        s->from[j] = row;
        if (!push(s, d, j)) return false;
    }
    return true;
}

static double cost_of(const struct solver *s, size_t row, size_t column)
{
    for (size_t e = s->first[row]; e < s->first[row + 1]; e++)
        if (s->pair[e].column == column) return s->pair[e].cost;
    return INFINITY;
}

/* Gives the columns on the way to `column` to the rows before them, back to `start`. */
static void turn_way(struct solver *s, size_t start, size_t column)
{
    while (column != SIZE_MAX) {
        const size_t row = s->from[column], next = s->partner[row];
        s->row_of[column] = row;
        s->paid[column] = cost_of(s, row, column);
        s->partner[row] = column;
        column = row == start ? SIZE_MAX : next;
    }
}

/* Adds one row along the shortest way, which ends at a free column or leaves a row alone. */
static bool add_row(struct solver *s, size_t start)
{
    double least = s->alone; /* length of the shortest way so far that ends with a row alone */
    size_t alone_column = SIZE_MAX, free_column = SIZE_MAX; /* column before the row that is left alone */
    s->n_open = s->n_touched = 0;
    bool fits = reach_row(s, start, 0.0);
    while (fits && s->n_open > 0) {
        const struct open_column o = pop(s);
        if (s->done[o.column] || o.distance > s->distance[o.column]) continue;
        if (o.distance >= least) break;
        s->done[o.column] = true;
        if (s->row_of[o.column] == SIZE_MAX) {
            least = o.distance;
            free_column = o.column;
            break;
        }
        const double at_row = o.distance - s->paid[o.column] + s->dual[o.column];
        if (at_row + s->alone < least) {
            least = at_row + s->alone;
            alone_column = o.column;
        }
        fits = reach_row(s, s->row_of[o.column], at_row);
    }
    for (size_t i = 0; i < s->n_touched; i++) {
        const size_t j = s->touched[i];
        if (s->done[j] && s->distance[j] < least) s->dual[j] += s->distance[j] - least;
    }
    if (free_column != SIZE_MAX) {
        turn_way(s, start, free_column);
    } else if (alone_column != SIZE_MAX) {
        const size_t row = s->row_of[alone_column];
        turn_way(s, start, alone_column);
        s->partner[row] = SIZE_MAX;
    }
    for (size_t i = 0; i < s->n_touched; i++) {
        s->distance[s->touched[i]] = INFINITY;
        s->done[s->touched[i]] = false;
    }
    return fits;
}

status assignment_find(const struct allowed_pair *pair, size_t n_pair, size_t n_row, size_t n_column, double alone,
                       size_t *partner, struct error *err)
{
    struct solver s = {.pair = pair,
                       .alone = alone,
                       .first = calloc(n_row + 1, sizeof *s.first),
                       .row_of = malloc((n_column + 1) * sizeof *s.row_of),
                       .from = malloc((n_column + 1) * sizeof *s.from),
                       .dual = calloc(n_column + 1, sizeof *s.dual),
                       .distance = malloc((n_column + 1) * sizeof *s.distance),
                       .paid = calloc(n_column + 1, sizeof *s.paid),
                       .touched = malloc((n_column + 1) * sizeof *s.touched),
                       .done = calloc(n_column + 1, sizeof *s.done),
                       .partner = partner};
    bool fits = s.first != NULL && s.row_of != NULL && s.from != NULL && s.dual != NULL && s.distance != NULL &&
                s.paid != NULL && s.touched != NULL && s.done != NULL;
    for (size_t i = 0; fits && i < n_pair; i++) s.first[pair[i].row + 1]++;
    for (size_t i = 0; fits && i < n_row; i++) {
        s.first[i + 1] += s.first[i];
        partner[i] = SIZE_MAX;
    }
    for (size_t j = 0; fits && j < n_column; j++) {
        s.row_of[j] = SIZE_MAX;
        s.distance[j] = INFINITY;
    }
    for (size_t i = 0; fits && i < n_row; i++) fits = add_row(&s, i);
    free(s.first);
    free(s.row_of);
    free(s.from);
    free(s.dual);
    free(s.distance);
    free(s.paid);
    free(s.touched);
    free(s.done);
    free(s.open);
    return fits ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot match the ends at a seam: out of memory");
}
