/* Checks of a described cloth that need no geometry: the draft, the orders of the kinds, and the ranges of numbers. */
#include "base/catalogue/cloth_films.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static size_t divisor(size_t a, size_t b) { return b == 0 ? a : divisor(b, a % b); }

/* Returns whether yarn i of a direction passes from one face of the cloth to the other within the draft. */
static bool crosses(const struct cloth_description *d, enum cloth_direction direction, size_t i)
{
    size_t n = direction == CLOTH_WEFT ? d->n_warp : d->n_weft;
    for (size_t k = 1; k < n; k++)
        if (direction == CLOTH_WEFT ? d->warp_over[i][k] != d->warp_over[i][0]
                                    : d->warp_over[k][i] != d->warp_over[0][i])
            return true;
    return false;
}

/* Returns whether yarn b lies above yarn a at a crossing of the draft. Wefts come first, then warps. */
static bool lies_above(const struct cloth_description *d, size_t a, size_t b)
{
    if (a < d->n_weft && b >= d->n_weft) return d->warp_over[a][b - d->n_weft];
    if (b < d->n_weft && a >= d->n_weft) return !d->warp_over[b][a - d->n_weft];
    return false;
}

/* Marks the yarns that come along when yarn 0 is lifted off (up: those above it, those above these, and so on) or taken
 * away downwards; returns how many. */
static size_t mark_layer(const struct cloth_description *d, bool up, bool layer[2 * CLOTH_MAX_DRAFT])
{
    const size_t n = d->n_weft + d->n_warp;
    size_t stack[2 * CLOTH_MAX_DRAFT] = {0}, n_stack = 1, n_layer = 1;
    for (size_t i = 0; i < n; i++) layer[i] = i == 0;
    while (n_stack > 0) {
        const size_t a = stack[--n_stack];
        for (size_t b = 0; b < n; b++) {
            if (layer[b] || !(up ? lies_above(d, a, b) : lies_above(d, b, a))) continue;
            layer[b] = true;
            n_layer++;
            stack[n_stack++] = b;
        }
    }
    return n_layer;
}

/* Checks that the cloth hangs together (Clapham 1980, When a fabric hangs together): no set of yarns lies above all
 * others. Yarns that never cross to the other face are named before. */
static status check_layers(const struct cloth_description *d, struct error *err)
{
    bool layer[2 * CLOTH_MAX_DRAFT];
    const size_t n = d->n_weft + d->n_warp;
    for (int up = 1; up >= 0; up--) {
        size_t n_layer = mark_layer(d, up == 1, layer), warp = d->n_weft;
        if (n_layer == n) continue;
        while (warp + 1 < n && !layer[warp]) warp++;
        return error_set_field(err, STATUS_INVALID, "draft",
                               "the draft falls apart into two cloths: %zu of its %zu yarns, weft 0 and warp %zu among "
                               "them, lie %s all others wherever they cross",
                               n_layer, n, warp - d->n_weft, up == 1 ? "above" : "below");
    }
    return STATUS_OK;
}

static status check_draft(const struct cloth_description *d, struct error *err)
{
    for (int k = 0; k < 2; k++) {
        enum cloth_direction direction = k == 0 ? CLOTH_WEFT : CLOTH_WARP;
        size_t n = direction == CLOTH_WEFT ? d->n_weft : d->n_warp;
        for (size_t i = 0; i < n; i++)
            if (!crosses(d, direction, i))
                return error_set_field(err, STATUS_INVALID, "draft",
                                       "%s %zu of the draft never crosses to the other face, so it is not held",
                                       direction == CLOTH_WEFT ? "weft" : "warp", i);
    }
    return check_layers(d, err);
}

static status check_order(const struct cloth_description *d, enum cloth_direction direction, struct error *err)
{
    const char *field = direction == CLOTH_WEFT ? "weft" : "warp";
    size_t n = d->n_order[direction];
    if (n < 1 || n > CLOTH_MAX_ORDER)
        return error_set_field(err, STATUS_INVALID, field, "the order of the %s has 1 to %d yarns", field,
                               CLOTH_MAX_ORDER);
    for (size_t i = 0; i < n; i++)
        if (d->order[direction][i] >= d->n_kind || (int)d->order[direction][i] == d->pile_kind)
            return error_set_field(err, STATUS_INVALID, field, "yarn %zu of the %s is of kind %d: 'yarns' has %zu, %s",
                                   i, field, (int)d->order[direction][i], d->n_kind,
                                   d->pile_kind < 0 ? "counted from 0" : "counted from 0, and the last is the pile");
    return STATUS_OK;
}

/* Chooses the number of yarns in the tile: the least multiple of the draft and of the order that shows several
 * repeats. */
static status choose_yarns(struct cloth_description *d, enum cloth_direction direction, struct error *err)
{
    enum { LEAST_YARN = 8, LEAST_LOOP = 4 };
    const char *field = direction == CLOTH_WEFT ? "weft" : "warp";
    bool knit = d->structure == CLOTH_KNIT;
    size_t draft = knit ? 1 : direction == CLOTH_WEFT ? d->n_weft : d->n_warp;
    size_t order = knit && direction == CLOTH_WARP ? 1 : d->n_order[direction];
    size_t repeat = draft / divisor(draft, order) * order, least = knit ? LEAST_LOOP : LEAST_YARN;
    if (repeat > CLOTH_MAX_YARN)
        return error_set_field(err, STATUS_INVALID, field,
                               "draft and order of the %s repeat together after %zu yarns only, at most %d are allowed",
                               field, repeat, CLOTH_MAX_YARN);
    if (d->n_yarn[direction] == 0) d->n_yarn[direction] = (least + repeat - 1) / repeat * repeat;
    if (d->n_yarn[direction] % repeat != 0 || d->n_yarn[direction] > CLOTH_MAX_YARN)
        return error_set_field(err, STATUS_INVALID, direction == CLOTH_WEFT ? "tile_wefts" : "tile_warps",
                               "the tile has %zu yarns of the %s: it must be a multiple of %zu, at most %d",
                               d->n_yarn[direction], field, repeat, CLOTH_MAX_YARN);
    return STATUS_OK;
}

static status check_kinds(const struct cloth_description *d, struct error *err)
{
    if (d->n_kind < 1 || d->n_kind > CLOTH_MAX_KIND)
        return error_set_field(err, STATUS_INVALID, "yarns", "a cloth has 1 to %d kinds of yarn", CLOTH_MAX_KIND);
    for (size_t k = 0; k < d->n_kind; k++) {
        const struct cloth_kind *kind = &d->kind[k];
        size_t most = d->structure == CLOTH_FELT ? CLOTH_MAX_FELT_FIBER : CLOTH_MAX_FIBER;
        char field[48];
        snprintf(field, sizeof field, "yarns[%zu].fibers", k);
        if (kind->n_fiber < (kind->film.width_um > 0.0 ? 0 : 1) || kind->n_fiber > most)
            return error_set_field(err, STATUS_INVALID, field, "'%s' is %zu, but must be between 1 and %zu", field,
                                   kind->n_fiber, most);
        snprintf(field, sizeof field, "yarns[%zu].plies", k);
        if (kind->n_ply < 1 || kind->n_ply > CLOTH_MAX_PLY ||
            (kind->n_ply > kind->n_fiber && (kind->n_fiber > 0 || kind->n_ply > 1)))
            return error_set_field(err, STATUS_INVALID, field,
                                   "'%s' is %zu, but must be between 1 and %d, and at most the number of fibers", field,
                                   kind->n_ply, CLOTH_MAX_PLY);
        snprintf(field, sizeof field, "yarns[%zu].melange_with", k);
        if (kind->melange_with >= (int)d->n_kind || kind->melange_with == (int)k)
            return error_set_field(err, STATUS_INVALID, field, "'%s' is %d: it must be another kind, below %zu", field,
                                   kind->melange_with, d->n_kind);
    }
    return STATUS_OK;
}

status cloth_description_enlarge(const struct cloth_description *d, size_t times, struct cloth_description *to,
                                 struct error *err)
{
    *to = *d;
    if (d->structure == CLOTH_FELT) {
        to->kind[0].n_fiber = d->kind[0].n_fiber * times * times;
        if (to->kind[0].n_fiber <= CLOTH_MAX_FELT_FIBER) return STATUS_OK;
        return error_set_field(err, STATUS_INVALID, "final_tiles",
                               "'final_tiles' is %zu: the tile would have %zu fibers, at most %d are allowed", times,
                               to->kind[0].n_fiber, CLOTH_MAX_FELT_FIBER);
    }
    for (int a = CLOTH_WEFT; a <= CLOTH_WARP; a++) {
        to->n_yarn[a] = d->n_yarn[a] * times;
        if (to->n_yarn[a] > CLOTH_MAX_YARN)
            return error_set_field(err, STATUS_INVALID, "final_tiles",
                                   "'final_tiles' is %zu: the tile would have %zu yarns of the %s, at most %d are "
                                   "allowed",
                                   times, to->n_yarn[a], a == CLOTH_WEFT ? "weft" : "warp", CLOTH_MAX_YARN);
    }
    return STATUS_OK;
}

/* A kind is used if a yarn is of it, if it is the pile, or if it is mixed into another. */
static bool kind_is_used(const struct cloth_description *d, size_t kind)
{
    if ((int)kind == d->pile_kind) return true;
    for (int a = CLOTH_WEFT; a <= CLOTH_WARP; a++)
        for (size_t i = 0; i < d->n_order[a] && (a == CLOTH_WEFT || d->structure != CLOTH_KNIT); i++)
            if (d->order[a][i] == kind) return true;
    for (size_t k = 0; k < d->n_kind; k++)
        if (d->kind[k].melange_with == (int)kind) return true;
    return false;
}

/* Checks that the cloth has a place for each kind, and for its plies and mixed fibers. */
static status check_places(const struct cloth_description *d, struct error *err)
{
    char field[48];
    if (d->structure == CLOTH_FELT && d->n_kind > 1)
        return error_set_field(err, STATUS_INVALID, "yarns", "a felt has one kind of fibers, 'yarns' has %zu",
                               d->n_kind);
    for (size_t k = 0; k < d->n_kind; k++) {
        snprintf(field, sizeof field, "yarns[%zu]", k);
        if (!kind_is_used(d, k))
            return error_set_field(err, STATUS_INVALID, field,
                                   "no yarn is of the kind '%s': name its place in 'warp' or 'weft', or leave it out",
                                   field);
        bool loose = d->structure == CLOTH_FELT || (int)k == d->pile_kind;
        snprintf(field, sizeof field, "yarns[%zu].plies", k);
        if (loose && d->kind[k].n_ply > 1)
            return error_set_field(err, STATUS_INVALID, field, "'%s': fibers of a felt or a pile have no plies", field);
        snprintf(field, sizeof field, "yarns[%zu].melange_with", k);
        if (loose && d->kind[k].melange_with >= 0)
            return error_set_field(err, STATUS_INVALID, field, "'%s': fibers of a pile are of one kind", field);
    }
    return STATUS_OK;
}

status cloth_number_check_one(const struct cloth_number *n, struct error *err)
{
    const struct cloth_number_info *i = n->info;
    if (!(n->value >= i->lower && n->value <= i->upper))
        return error_set_field(err, STATUS_INVALID, n->name, "'%s' is %g, but must be between %g and %g", n->name,
                               n->value, i->lower, i->upper);
    if (!n->fitted) return STATUS_OK;
    if (!(n->lower >= i->lower && n->upper <= i->upper && n->lower < n->upper))
        return error_set_field(err, STATUS_INVALID, n->name,
                               "the bounds of '%s' are %g and %g: they must rise, within %g and %g", n->name, n->lower,
                               n->upper, i->lower, i->upper);
    if (!(n->value >= n->lower && n->value <= n->upper))
        return error_set_field(err, STATUS_INVALID, n->name, "'%s' starts at %g, outside of its bounds %g and %g",
                               n->name, n->value, n->lower, n->upper);
    if (!isnan(n->prior_sd) && !(n->prior_sd > 0.0 && isfinite(n->prior_mean)))
        return error_set_field(err, STATUS_INVALID, n->name,
                               "the prior of '%s' needs a mean and a positive standard deviation", n->name);
    if (n->prior_mean < i->lower || n->prior_mean > i->upper) /* false for NaN: no prior */
        return error_set_field(err, STATUS_INVALID, n->name,
                               "the mean of the prior of '%s' is %g, but must be between %g and %g", n->name,
                               n->prior_mean, i->lower, i->upper);
    return STATUS_OK;
}

/* Returns whether a number `name` of kind (-1: of the cloth or of any kind) is fitted or not 0. */
static bool is_there(const struct cloth_description *d, int kind, const char *name)
{
    for (size_t i = 0; i < d->n_number; i++) {
        const struct cloth_number *n = &d->number[i];
        if (strcmp(n->info->name, name) == 0 && (kind < 0 || n->kind == kind) && (n->fitted || n->value != 0.0))
            return true;
    }
    return false;
}

/* Refuses to fit a number that changes nothing, because another one is 0. */
static status check_effect(const struct cloth_description *d, struct error *err)
{
    static const struct {
        const char *name, *needs;
    } table[] = {{"hair_length_um", "hairs_per_mm"},
                 {"nap_tilt_deg", "hairs_per_mm"},
                 {"nap_direction_deg", "nap_tilt_deg"},
                 {"pile_direction_deg", "pile_tilt_deg"}};
    for (size_t i = 0; i < d->n_number; i++)
        for (size_t k = 0; k < sizeof table / sizeof *table; k++)
            if (d->number[i].fitted && strcmp(d->number[i].info->name, table[k].name) == 0 &&
                !is_there(d, d->number[i].kind, table[k].needs))
                return error_set_field(err, STATUS_INVALID, d->number[i].name,
                                       "'%s' cannot be fitted: it changes nothing while '%s' is 0", d->number[i].name,
                                       table[k].needs);
    return STATUS_OK;
}

status cloth_description_check(struct cloth_description *d, struct error *err)
{
    status st = check_kinds(d, err);
    if (st == STATUS_OK && (d->structure == CLOTH_WOVEN || d->structure == CLOTH_VELVET)) st = check_draft(d, err);
    for (int k = 0; k < 2 && d->structure != CLOTH_FELT && st == STATUS_OK; k++) {
        enum cloth_direction a = k == 0 ? CLOTH_WEFT : CLOTH_WARP;
        st = check_order(d, a, err);
        if (st == STATUS_OK) st = choose_yarns(d, a, err);
    }
    if (st == STATUS_OK) st = check_places(d, err);
    if (st == STATUS_OK) st = cloth_films_check(d, err);
    for (size_t i = 0; i < d->n_number && st == STATUS_OK; i++) st = cloth_number_check_one(&d->number[i], err);
    if (st == STATUS_OK) st = check_effect(d, err);
    return st;
}
