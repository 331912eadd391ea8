#include "optimizer/job/document/fiber_composition.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double most_off = 0.5; /* percent: labels round */

static const char *skip_spaces(const char *text) { return text + strspn(text, " "); }

/* One part, which ends before n bytes. */
static bool read_part(const char *text, size_t n, struct fiber_composition *c)
{
    char *end;
    const double percent = strtod(text, &end);
    const char *at = skip_spaces(end), *past = text + n;
    if (end == text || !(percent > 0.0 && percent <= 100.0) || at >= past || *at != '%') return false;
    at = skip_spaces(at + 1);
    while (past > at && past[-1] == ' ') past--;
    if (at >= past || past - at >= FIBER_NAME_BYTES) return false;
    memcpy(c->part[c->n_part].name, at, (size_t)(past - at));
    c->part[c->n_part].name[past - at] = '\0';
    c->part[c->n_part++].share = percent / 100.0;
    return true;
}

status fiber_composition_read(const char *text, struct fiber_composition *c, struct error *err)
{
    double sum = 0.0;
    memset(c, 0, sizeof *c);
    for (const char *at = skip_spaces(text); *at != '\0';) {
        const size_t n = strcspn(at, ",;");
        if (c->n_part == FIBER_COMPOSITION_MOST)
            return error_set(err, STATUS_INVALID, "it has more than %d parts", FIBER_COMPOSITION_MOST);
        if (!read_part(at, n, c))
            return error_set(err, STATUS_INVALID,
                             "'%.*s' is not a percentage and a fiber: write it like \"60 %% cotton, 40 %% polyester\"",
                             n < 80 ? (int)n : 80, at);
        at = skip_spaces(at + n + (at[n] != '\0'));
    }
    for (size_t i = 0; i < c->n_part; i++) sum += 100.0 * c->part[i].share;
    if (c->n_part > 0 && fabs(sum - 100.0) > most_off)
        return error_set(err, STATUS_INVALID, "its parts sum to %.4g %%, not to 100", sum);
    for (size_t i = 0; i < c->n_part; i++) c->part[i].share *= 100.0 / sum;
    return STATUS_OK;
}
