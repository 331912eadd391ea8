#include "base/catalogue/cloth_description.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define CLOTH_NUMBER(name, unit, lower, upper, standard, coordinate, structures, meaning)                              \
    {#name, unit, false, lower, upper, standard, coordinate, structures, meaning},
#define YARN_NUMBER(name, unit, lower, upper, standard, coordinate, structures, meaning)                               \
    {#name, unit, true, lower, upper, standard, coordinate, structures, meaning},
const struct cloth_number_info cloth_number_table[] = {
#include "base/catalogue/cloth_numbers.def"
    {NULL}};

/* Drafts as rows of '1' (warp over weft), the upper edge of the cloth first. */
static const struct {
    const char *name;
    enum cloth_structure structure;
    const char *row[8];
} weave_table[] = {
    {"plain", CLOTH_WOVEN, {"01", "10"}},
    {"twill", CLOTH_WOVEN, {"0110", "1100", "1001", "0011"}},
    {"twill31", CLOTH_WOVEN, {"1101", "1011", "0111", "1110"}},
    {"satin", CLOTH_WOVEN, {"11101", "10111", "11110", "11011", "01111"}},
    {"basket", CLOTH_WOVEN, {"1100", "1100", "0011", "0011"}},
    {"rib", CLOTH_WOVEN, {"10", "10", "01", "01"}},
    {"jersey", CLOTH_KNIT, {NULL}},
    {"velvet", CLOTH_VELVET, {"01", "10"}},
    {"felt", CLOTH_FELT, {NULL}},
};
enum { N_WEAVE = sizeof weave_table / sizeof *weave_table };
/* Fibers in a section when nothing is said: of a yarn, of a tuft of the pile, and in the tile of a felt. */
enum { YARN_FIBERS = 40, TUFT_FIBERS = 16, FELT_FIBERS = 600 };

const char *const cloth_weave_names[N_WEAVE + 1] = {"plain", "twill",  "twill31", "satin", "basket",
                                                    "rib",   "jersey", "velvet",  "felt",  NULL};

static status unknown_weave(const char *weave, struct error *err)
{
    char names[128] = "";
    for (size_t i = 0; i < N_WEAVE; i++) {
        size_t n = strlen(names);
        snprintf(names + n, sizeof names - n, "%s%s",
                 i == 0             ? ""
                 : i + 1 == N_WEAVE ? " or "
                                    : ", ",
                 weave_table[i].name);
    }
    return error_set_field(err, STATUS_INVALID, "weave", "unknown weave '%.40s': it is %s", weave, names);
}

status cloth_description_init(struct cloth_description *d, const char *weave, struct error *err)
{
    size_t w = 0, n_row = 0;
    while (w < N_WEAVE && strcmp(weave_table[w].name, weave) != 0) w++;
    if (w == N_WEAVE) return unknown_weave(weave, err);
    *d = (struct cloth_description){.n_kind = 1, .pile_kind = -1, .n_order = {1, 1}, .seed = 1};
    d->kind[0] = (struct cloth_kind){.n_fiber = YARN_FIBERS, .n_ply = 1, .melange_with = -1};
    while (n_row < 8 && weave_table[w].row[n_row] != NULL) n_row++;
    status st = n_row > 0 ? cloth_description_draft(d, weave_table[w].row, n_row, err) : STATUS_OK;
    snprintf(d->weave, sizeof d->weave, "%s", weave);
    d->structure = weave_table[w].structure;
    if (d->structure == CLOTH_FELT) d->kind[0].n_fiber = FELT_FIBERS;
    if (d->structure == CLOTH_VELVET) {
        d->n_kind = 2;
        d->pile_kind = 1;
        d->kind[1] = (struct cloth_kind){.n_fiber = TUFT_FIBERS, .n_ply = 1, .melange_with = -1};
    }
    cloth_description_number(d);
    return st;
}

status cloth_description_draft(struct cloth_description *d, const char *const *row, size_t n_row, struct error *err)
{
    size_t n_column = n_row > 0 ? strlen(row[0]) : 0;
    if (n_row == 0 || n_row > CLOTH_MAX_DRAFT || n_column == 0 || n_column > CLOTH_MAX_DRAFT)
        return error_set_field(err, STATUS_INVALID, "draft", "a draft has 1 to %d rows of 1 to %d signs",
                               CLOTH_MAX_DRAFT, CLOTH_MAX_DRAFT);
    for (size_t i = 0; i < n_row; i++) {
        if (strlen(row[i]) != n_column)
            return error_set_field(err, STATUS_INVALID, "draft",
                                   "the draft does not repeat: row %zu has %zu signs, row 0 has %zu", i, strlen(row[i]),
                                   n_column);
        for (size_t j = 0; j < n_column; j++) {
            if (row[i][j] != '0' && row[i][j] != '1')
                return error_set_field(err, STATUS_INVALID, "draft",
                                       "row %zu of the draft has '%c': it takes 1 (warp over weft) and 0", i,
                                       row[i][j]);
            d->warp_over[n_row - 1 - i][j] = row[i][j] == '1';
        }
    }
    d->n_weft = n_row;
    d->n_warp = n_column;
    d->structure = CLOTH_WOVEN;
    d->weave[0] = '\0';
    return STATUS_OK;
}

/* Returns the bits of enum cloth_has for the cloth (kind -1) or for one of its kinds of yarn. */
static unsigned has(const struct cloth_description *d, int kind)
{
    static const unsigned of_structure[CLOTH_N_STRUCTURE] = {CLOTH_HAS_WEAVE, CLOTH_HAS_LOOPS,
                                                             CLOTH_HAS_WEAVE | CLOTH_HAS_PILE, CLOTH_HAS_FELT};
    unsigned mask = of_structure[d->structure];
    if (kind < 0 && (mask & CLOTH_HAS_WEAVE) != 0) {
        if (!(d->threads_per_cm[CLOTH_WARP] > 0.0)) mask |= CLOTH_HAS_WARP_COVER;
        if (!(d->threads_per_cm[CLOTH_WEFT] > 0.0)) mask |= CLOTH_HAS_WEFT_COVER;
    }
    if (kind < 0) return mask;
    if (d->kind[kind].n_fiber == 0) return 0;
    if (d->structure == CLOTH_VELVET) mask = kind == d->pile_kind ? CLOTH_HAS_PILE : CLOTH_HAS_WEAVE;
    if (d->kind[kind].n_ply > 1) mask |= CLOTH_HAS_PLIES;
    if (d->kind[kind].melange_with >= 0) mask |= CLOTH_HAS_MELANGE;
    return mask;
}

static void list_number(struct cloth_description *d, const struct cloth_description *before,
                        const struct cloth_number_info *info, int kind)
{
    struct cloth_number n = {.info = info,
                             .kind = kind,
                             .value = info->standard,
                             .lower = info->lower,
                             .upper = info->upper,
                             .prior_mean = NAN,
                             .prior_sd = NAN};
    if (kind < 0)
        snprintf(n.name, sizeof n.name, "%s", info->name);
    else
        snprintf(n.name, sizeof n.name, "yarns[%d].%s", kind, info->name);
    int at = cloth_number_index(before, n.name);
    d->number[d->n_number++] = at >= 0 ? before->number[at] : n;
}

void cloth_description_number(struct cloth_description *d)
{
    const struct cloth_description before = *d;
    d->n_number = 0;
    for (const struct cloth_number_info *i = cloth_number_table; i->name != NULL; i++)
        if (!i->of_yarn && (i->structures & has(d, -1)) != 0) list_number(d, &before, i, -1);
    for (int k = 0; k < (int)d->n_kind; k++)
        for (const struct cloth_number_info *i = cloth_number_table; i->name != NULL; i++)
            if (i->of_yarn && (i->structures & has(d, k)) != 0) list_number(d, &before, i, k);
}

int cloth_number_index(const struct cloth_description *d, const char *name)
{
    for (size_t i = 0; i < d->n_number; i++)
        if (strcmp(d->number[i].name, name) == 0) return (int)i;
    return -1;
}

double cloth_number_value(const struct cloth_description *d, const double *number, int kind, const char *name)
{
    for (size_t i = 0; i < d->n_number; i++)
        if (d->number[i].kind == kind && strcmp(d->number[i].info->name, name) == 0)
            return number != NULL ? number[i] : d->number[i].value;
    return NAN;
}

status cloth_number_check(const struct cloth_description *d, const double *number, struct error *err)
{
    for (size_t i = 0; i < d->n_number; i++) {
        const struct cloth_number *n = &d->number[i];
        if (number[i] >= n->info->lower && number[i] <= n->info->upper) continue;
        return error_set_field(err, STATUS_INVALID, n->name, "'%s' is %g, but must be between %g and %g", n->name,
                               number[i], n->info->lower, n->info->upper);
    }
    return STATUS_OK;
}
