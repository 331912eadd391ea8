/* Films of a described cloth: their groups, and checks. */
#include "base/catalogue/cloth_films.h"

#include <math.h>
#include <stdio.h>

_Static_assert((int)FILM_MAX_GROUP >= (int)CLOTH_MAX_KIND + 1,
               "each kind of yarn may have a film, and there are sequins");

size_t cloth_n_fiber_kind(const struct cloth_description *d)
{
    size_t n = 0;
    while (n < d->n_kind && d->kind[n].n_fiber > 0) n++;
    return n;
}

size_t cloth_film_group(const struct cloth_description *d, size_t kind)
{
    size_t group = cloth_n_fiber_kind(d);
    for (size_t k = 0; k < kind && k < d->n_kind; k++) group += d->kind[k].film.width_um > 0.0;
    return group;
}

void cloth_film_groups(const struct cloth_description *d, struct film_groups *g)
{
    *g = (struct film_groups){.first_group = cloth_n_fiber_kind(d)};
    for (size_t k = 0; k < d->n_kind; k++)
        if (d->kind[k].film.width_um > 0.0) g->material[g->n++] = d->kind[k].film.material;
    if (d->sequins.diameter_um > 0.0) g->material[g->n++] = d->sequins.material;
}

static bool in_range(double value, double lower, double upper) { return value >= lower && value <= upper; }

static status check_film(const struct cloth_description *d, size_t k, struct error *err)
{
    const struct cloth_film *f = &d->kind[k].film;
    char field[48];
    if (!(f->width_um > 0.0)) return STATUS_OK;
    snprintf(field, sizeof field, "yarns[%zu].film_width_um", k);
    if (d->structure == CLOTH_FELT || (int)k == d->pile_kind)
        return error_set_field(err, STATUS_INVALID, field, "'%s': fibers of a felt or a pile have no film", field);
    if (!in_range(f->width_um / f->thickness_um, 1.5, CLOTH_FILM_MOST_RATIO))
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' is %g: a film is 1.5 to %g times as wide as the thickness, %g um", field,
                               f->width_um, CLOTH_FILM_MOST_RATIO, f->thickness_um);
    return STATUS_OK;
}

status cloth_films_check(const struct cloth_description *d, struct error *err)
{
    const struct cloth_sequins *q = &d->sequins;
    char field[48];
    status s = STATUS_OK;
    for (size_t k = 0; k < d->n_kind && s == STATUS_OK; k++) s = check_film(d, k, err);
    for (size_t k = 0; k + 1 < d->n_kind && s == STATUS_OK; k++) {
        snprintf(field, sizeof field, "yarns[%zu].fibers", k);
        if (d->kind[k].n_fiber == 0 && d->kind[k + 1].n_fiber > 0)
            s = error_set_field(err, STATUS_INVALID, field,
                                "'%s' is 0: kinds of yarn that are a film alone come last in 'yarns'", field);
    }
    for (size_t k = 0; k < d->n_kind && s == STATUS_OK; k++) {
        const int with = d->kind[k].melange_with;
        snprintf(field, sizeof field, "yarns[%zu].melange_with", k);
        if (with >= 0 && (d->kind[k].n_fiber == 0 || d->kind[with].n_fiber == 0))
            s = error_set_field(err, STATUS_INVALID, field, "'%s' is %d: a film alone has no fibers to mix", field,
                                with);
    }
    struct film_groups groups;
    cloth_film_groups(d, &groups);
    if (s == STATUS_OK && groups.first_group + groups.n > CLOTH_MAX_GROUP)
        s = error_set_field(err, STATUS_INVALID, "yarns",
                            "the cloth has %zu kinds of fibers and %zu of films, at most %d are allowed in all",
                            groups.first_group, groups.n, CLOTH_MAX_GROUP);
    if (s != STATUS_OK || !(q->diameter_um > 0.0)) return s;
    if (!in_range(q->diameter_um / q->thickness_um, 1.5, CLOTH_FILM_MOST_RATIO))
        return error_set_field(
            err, STATUS_INVALID, "sequin_diameter_um",
            "'sequin_diameter_um' is %g: a sequin is 1.5 to %g times as wide as its thickness, %g um", q->diameter_um,
            CLOTH_FILM_MOST_RATIO, q->thickness_um);
    return STATUS_OK;
}
