#include "geometry/volume/format/slice_order.h"
#include "base/option_id.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Digits beyond 18 are no number that counts slices. */
enum { MAX_NUMBER = 8, MAX_DIGITS = 18, NAME_ROOM = 200 };
static const char digits[] = "0123456789";

/* The numbers of a name, and where they stand. */
struct numbers {
    size_t n, at[MAX_NUMBER], n_digit[MAX_NUMBER];
    unsigned long long value[MAX_NUMBER];
};

/* A file with the number that counts its slice. */
struct numbered {
    unsigned long long value;
    size_t i;
};

static void find_numbers(const char *name, struct numbers *f)
{
    f->n = 0;
    for (size_t at = strcspn(name, digits); name[at] != '\0' && f->n < MAX_NUMBER; at += strcspn(name + at, digits)) {
        const size_t n = strspn(name + at, digits);
        if (n <= MAX_DIGITS) {
            f->at[f->n] = at;
            f->n_digit[f->n] = n;
            f->value[f->n++] = strtoull(name + at, NULL, 10);
        }
        at += n;
    }
}

/* Whether two names are equal but for their numbers and the case of letters. */
static bool same_series(const char *a, const struct numbers *x, const char *b, const struct numbers *y)
{
    if (x->n != y->n) return false;
    size_t p = 0, q = 0;
    for (size_t i = 0; i < x->n; i++) {
        if (x->at[i] - p != y->at[i] - q || strncasecmp(a + p, b + q, x->at[i] - p) != 0) return false;
        p = x->at[i] + x->n_digit[i];
        q = y->at[i] + y->n_digit[i];
    }
    return strcasecmp(a + p, b + q) == 0;
}

static int by_value(const void *pa, const void *pb)
{
    const struct numbered *a = pa, *b = pb;
    if (a->value != b->value) return a->value < b->value ? -1 : 1;
    return a->i < b->i ? -1 : a->i > b->i;
}

/* Sorts the files by their number `k`. Returns the first of two neighbours with the same number, n where there are
 * none. */
static size_t sort_by_number(const struct numbers *f, size_t n, size_t k, struct numbered *out)
{
    for (size_t i = 0; i < n; i++) out[i] = (struct numbered){f[i].value[k], i};
    qsort(out, n, sizeof *out, by_value);
    for (size_t i = 0; i + 1 < n; i++)
        if (out[i].value == out[i + 1].value) return i;
    return n;
}

static bool varies(const struct numbers *f, size_t n, size_t k)
{
    for (size_t i = 1; i < n; i++)
        if (f[i].value[k] != f[0].value[k]) return true;
    return false;
}

static status refuse_double(const char *const *name, const struct numbered *twice, struct error *err)
{
    return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES, "the slices '%s' and '%s' have the same number",
                           name[twice[0].i], name[twice[1].i]);
}

/* Finds the number that counts the slices: the one that is different in all names, and of several (such as times) the
 * one of the smallest range. Leaves the files sorted by it. */
static status choose_number(const char *const *name, const struct numbers *f, size_t n, struct numbered *sorted,
                            size_t *chosen, struct error *err)
{
    size_t n_varying = 0, last = 0;
    unsigned long long least = 0;
    *chosen = MAX_NUMBER;
    for (size_t k = 0; k < f[0].n; k++) {
        if (!varies(f, n, k)) continue;
        n_varying++;
        last = k;
        if (sort_by_number(f, n, k, sorted) < n) continue;
        const unsigned long long range = sorted[n - 1].value - sorted[0].value;
        if (*chosen == MAX_NUMBER || range < least) {
            *chosen = k;
            least = range;
        }
    }
    if (*chosen < MAX_NUMBER) {
        sort_by_number(f, n, *chosen, sorted);
        return STATUS_OK;
    }
    if (n_varying > 1)
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                               "the names of the slices, such as '%s' and '%s', count along %zu numbers: a scan is one "
                               "stack, so name the files of one channel or time alone",
                               name[0], name[n - 1], n_varying);
    return refuse_double(name, sorted + sort_by_number(f, n, last, sorted), err);
}

/* Writes a name with another number. */
static void rename_slice(const char *name, const struct numbers *f, size_t k, unsigned long long value, char *out)
{
    snprintf(out, NAME_ROOM, "%.*s%0*llu%s", (int)f->at[k], name, (int)f->n_digit[k], value,
             name + f->at[k] + f->n_digit[k]);
}

/* Refuses a step that is larger than the least one, with the names that are missing. */
static status check_gaps(const char *const *name, const struct numbers *f, size_t k, const struct numbered *sorted,
                         size_t n, struct slice_order *order, struct error *err)
{
    unsigned long long n_missing = 0;
    size_t first = n;
    order->step = sorted[1].value - sorted[0].value;
    for (size_t i = 1; i + 1 < n; i++)
        if (sorted[i + 1].value - sorted[i].value < order->step) order->step = sorted[i + 1].value - sorted[i].value;
    for (size_t i = 0; i + 1 < n; i++) {
        const unsigned long long step = sorted[i + 1].value - sorted[i].value;
        if (step > order->step && first == n) first = i;
        n_missing += (step - 1) / order->step;
    }
    if (first == n) return STATUS_OK;
    char from[NAME_ROOM], to[NAME_ROOM];
    const size_t i = sorted[first].i;
    rename_slice(name[i], &f[i], k, sorted[first].value + order->step, from);
    rename_slice(name[i], &f[i], k, sorted[first + 1].value - order->step, to);
    const bool one = sorted[first].value + order->step >= sorted[first + 1].value - order->step;
    return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                           "the numbering of the slices has gaps, %llu in all are missing: '%s'%s%s%s between '%s' and "
                           "'%s'",
                           n_missing, from, one ? "" : " to '", one ? "" : to, one ? "" : "'", name[i],
                           name[sorted[first + 1].i]);
}

/* The files must have the order of their numbers, or the opposite one. */
static status check_sequence(const char *const *name, const struct numbers *f, size_t n, size_t k, struct error *err)
{
    const bool rising = f[1].value[k] > f[0].value[k];
    for (size_t i = 1; i + 1 < n; i++)
        if ((f[i + 1].value[k] > f[i].value[k]) != rising)
            return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                                   "the slices are not in the order of their numbers: '%s' comes after '%s' and "
                                   "before '%s'",
                                   name[i], name[i - 1], name[i + 1]);
    return STATUS_OK;
}

static status check(const char *const *name, size_t n, struct numbers *f, struct numbered *sorted,
                    struct slice_order *order, struct error *err)
{
    size_t k = 0, n_number = 0;
    for (size_t i = 0; i < n; i++) {
        find_numbers(name[i], &f[i]);
        n_number += f[i].n > 0;
    }
    if (n_number == 0) return STATUS_OK;
    for (size_t i = 1; i < n; i++)
        if (!same_series(name[0], &f[0], name[i], &f[i]))
            return error_set_field(
                err, STATUS_INVALID, OPTION_SCAN_FILES,
                "'%s' does not belong to the slices of '%s': their names differ in more than numbers", name[i],
                name[0]);
    status s = choose_number(name, f, n, sorted, &k, err);
    if (s == STATUS_OK) s = check_sequence(name, f, n, k, err);
    return s == STATUS_OK ? check_gaps(name, f, k, sorted, n, order, err) : s;
}

status slice_order_check(const char *const *name, size_t n, struct slice_order *order, struct error *err)
{
    *order = (struct slice_order){0};
    if (n < 2) return STATUS_OK;
    struct numbers *f = calloc(n, sizeof *f);
    struct numbered *sorted = calloc(n, sizeof *sorted);
    status s = f != NULL && sorted != NULL
                   ? check(name, n, f, sorted, order, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot check the order of the slices: out of memory");
    free(f);
    free(sorted);
    return s;
}
