#include "geometry/cloth/cloth.h"

#include "geometry/cloth/film_obstacle.h"
#include "geometry/fibers/fiber_view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rounds of pushing fibers apart; pixels along the tile where the cover is measured. */
enum { RELAX_ROUNDS = 12, VIEW_PIXELS = 400 };

static status make(struct cloth_work *w, struct error *err)
{
    switch (w->d->structure) {
    case CLOTH_KNIT:
        return cloth_knit(w, err);
    case CLOTH_FELT:
        return cloth_felt(w, err);
    default:
        return cloth_weave(w, err);
    }
}

static void report_kinds(const struct cloth_work *w, struct cloth_report *r)
{
    for (size_t k = 0; k < w->d->n_kind && w->d->structure != CLOTH_FELT; k++) {
        const struct kind_shape *s = &w->kind[k];
        if ((int)k == w->d->pile_kind) continue;
        double turns = s->n_ply > 1 ? s->ply_twist_per_m : s->twist_per_m;
        r->yarn_width_m[k] = 2.0 * s->half_m[0];
        r->yarn_height_m[k] = 2.0 * s->half_m[1];
        r->surface_angle_rad[k] = atan(2.0 * M_PI * turns * s->round_m);
    }
}

static void report_fibers(const struct fiber_set *f, struct cloth_report *r)
{
    double low, high, volume = 0.0;
    fiber_set_z_range_m(f, &low, &high);
    for (size_t i = 0; i < f->n_fiber; i++) {
        struct fiber_set one = {.n_fiber = 1, .first_vertex = f->first_vertex + i, .position_m = f->position_m};
        double length_m = fiber_set_length_m(&one);
        volume += M_PI * (double)f->radius_m[i] * (double)f->radius_m[i] * length_m;
        r->n_fiber[f->group[i]]++;
        r->length_m[f->group[i]] += length_m;
    }
    r->thickness_m = high - low;
    r->volume_fraction = volume / (f->tile_size_m[0] * f->tile_size_m[1] * r->body_thickness_m);
}

/* Height from the lowest to the highest surface of films and of fibers that are no hairs. */
static double body_thickness_m(const struct cloth_work *w)
{
    const struct strand_set *s = &w->set;
    double low = INFINITY, high = -INFINITY;
    cloth_film_range(w, &low, &high);
    for (size_t i = 0; i < s->n_strand; i++) {
        const struct strand *t = &s->strand[i];
        for (size_t k = t->first; k < t->first + t->n && !t->hair; k++) {
            low = fmin(low, s->p[k][2] - t->radius_m);
            high = fmax(high, s->p[k][2] + t->radius_m);
        }
    }
    return high - low;
}

static double strand_highest_m(const struct strand_set *s)
{
    double high = -INFINITY;
    for (size_t i = 0; i < s->n_strand; i++)
        for (size_t k = 0; k < s->strand[i].n; k++)
            high = fmax(high, s->p[s->strand[i].first + k][2] + s->strand[i].radius_m);
    return high;
}

static double thickest_m(const struct strand_set *s)
{
    double most_m = 0.0;
    for (size_t i = 0; i < s->n_strand; i++) most_m = fmax(most_m, s->strand[i].radius_m);
    return most_m;
}

static status report_fill(const struct cloth_work *w, const struct strand_fit *fit, const struct fiber_set *f,
                          struct cloth_report *r, struct error *err)
{
    size_t size[2];
    for (int a = 0; a < 2; a++) {
        r->tile_m[a] = w->set.tile_m[a];
        r->n_yarn[a] = w->d->structure == CLOTH_FELT ? 0 : w->d->n_yarn[a];
        r->yarn_spacing_m[a] = w->spacing_m[a];
    }
    r->overlap_mean = fit->overlap_mean;
    r->overlap_max = fit->overlap_max;
    r->strain_p95 = fit->strain_p95;
    r->body_thickness_m = body_thickness_m(w);
    report_kinds(w, r);
    report_fibers(f, r);
    return fiber_top_view(f, fmax(fmax(r->tile_m[0], r->tile_m[1]) / VIEW_PIXELS, 0.4 * thickest_m(&w->set)), size,
                          NULL, &r->cover, err);
}

/* The fibers of all strands and films, the lowest of them at 0; sequins lie on top. */
static status emit(struct cloth_work *w, struct fiber_set *f, struct error *err)
{
    const double strands_m = strand_lowest_m(&w->set);
    double low_m = strands_m, high_m = strand_highest_m(&w->set);
    cloth_film_range(w, &low_m, &high_m);
    status st = w->d->sequins.diameter_um > 0.0 ? cloth_film_sequins(w, high_m, err) : STATUS_OK;
    cloth_film_range(w, &low_m, &high_m);
    fiber_set_release(f);
    /* vertices at the nodes alone: they are near enough for the bends that fibers can have */
    if (st == STATUS_OK && w->set.n_strand > 0)
        st = strand_emit(&w->set, thickest_m(&w->set), strands_m - low_m, f, err);
    return st == STATUS_OK ? cloth_film_append(w, -low_m, f, err) : st;
}

/* Pushes the strands apart and out of the films. */
static status relax(struct cloth_work *w, struct thread_pool *pool, const struct progress *progress,
                    struct strand_fit *fit, struct error *err)
{
    const struct strand_relax_option o = {.n_round = RELAX_ROUNDS, .rule = STRAND_SMOOTH};
    const size_t n_strand = w->set.n_strand, n_node = w->set.n_node;
    if (n_strand == 0) return STATUS_OK;
    status st = film_obstacles_add(w, err);
    if (st == STATUS_OK) st = strand_relax(&w->set, &o, pool, progress, fit, err);
    w->set.n_strand = n_strand;
    w->set.n_node = n_node;
    return st;
}

status cloth_build(const struct cloth_description *d, const double *number, struct thread_pool *pool,
                   const struct progress *progress, struct fiber_set *f, struct cloth_report *report, struct error *err)
{
    double own[CLOTH_MAX_NUMBER];
    for (size_t i = 0; i < d->n_number; i++) own[i] = number != NULL ? number[i] : d->number[i].value;
    struct cloth_work w = {.d = d, .number = own};
    struct strand_fit fit = {0};
    if (report != NULL) memset(report, 0, sizeof *report);
    status st = cloth_number_check(d, own, err);
    if (st != STATUS_OK) return st;
    kind_shapes(&w);
    st = make(&w, err);
    if (st == STATUS_OK) st = relax(&w, pool, progress, report != NULL ? &fit : NULL, err);
    if (st == STATUS_OK) st = emit(&w, f, err);
    if (st == STATUS_OK) st = fiber_set_validate(f, err);
    if (st == STATUS_OK && report != NULL) st = report_fill(&w, &fit, f, report, err);
    strand_set_release(&w.set);
    free(w.film.node);
    return st;
}
