#include "renderer/mesh/mesh_curves.h"

#include <math.h>

enum { TURN_CELLS = 120, TAIL_CELLS = 8, FOLD_CELLS = 96, MOST_TURNS = 200, MOST_FOLDS = 50 };

/* Allocates a strip of n_cell cells along u and one along v. Texture: v from -across_mm / 2 on; u is the caller's. */
static status new_strip(size_t n_cell, double across_mm, struct mesh *m, struct error *err)
{
    const size_t n = n_cell + 1;
    status s = mesh_new(m, 2 * n, 2 * n, 2 * n_cell, err);
    for (size_t i = 0; s == STATUS_OK && i < n_cell; i++) {
        const uint32_t a = (uint32_t)i, b = a + 1, c = (uint32_t)(n + i), d = c + 1;
        m->triangle[2 * i] = (struct mesh_triangle){{a, b, d}, {a, b, d}};
        m->triangle[2 * i + 1] = (struct mesh_triangle){{a, d, c}, {a, d, c}};
    }
    for (size_t i = 0; s == STATUS_OK && i < 2 * n; i++) m->texture_mm[i][1] = across_mm * (i < n ? -0.5 : 0.5);
    return s;
}

/* Puts point i of the curve: x and its coordinate along axis `second`; the cloth goes on along the
 * third axis. Texture u is the length of the chords so far. */
static void put_point(struct mesh *m, size_t i, const double p_mm[2], int second)
{
    const size_t n = m->n_position / 2;
    double u = 0.0;
    if (i > 0)
        u = m->texture_mm[i - 1][0] +
            hypot(p_mm[0] - m->position_mm[i - 1][0], p_mm[1] - m->position_mm[i - 1][second]);
    for (size_t k = i; k < 2 * n; k += n) {
        m->position_mm[k][0] = p_mm[0];
        m->position_mm[k][second] = p_mm[1];
        m->position_mm[k][3 - second] = m->texture_mm[k][1];
        m->texture_mm[k][0] = u;
    }
}

static void centre(struct mesh *m)
{
    for (int a = 0; a < 3; a++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < m->n_position; i++) {
            low = fmin(low, m->position_mm[i][a]);
            high = fmax(high, m->position_mm[i][a]);
        }
        for (size_t i = 0; i < m->n_position; i++) m->position_mm[i][a] -= 0.5 * (low + high);
    }
}

status mesh_roll_make(const struct mesh_roll *r, struct mesh *m, struct error *err)
{
    const double turns = (r->radius_mm - r->core_mm) / r->pitch_mm;
    if (!(r->core_mm > 0.0 && r->pitch_mm > 0.0 && r->tail_mm > 0.0 && r->length_mm > 0.0 && turns > 0.0 &&
          turns <= MOST_TURNS))
        return error_set(err, STATUS_INVALID,
                         "cannot make a roll of radius %g mm with turns of %g mm and a core of %g mm", r->radius_mm,
                         r->pitch_mm, r->core_mm);
    const size_t n_turn = (size_t)ceil(turns * TURN_CELLS);
    status s = new_strip(TAIL_CELLS + n_turn, r->length_mm, m, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < TAIL_CELLS; i++)
        put_point(m, i, (double[2]){r->tail_mm * (1.0 - (double)i / TAIL_CELLS), -r->radius_mm}, 2);
    for (size_t i = 0; i <= n_turn; i++) {
        const double turn = (double)i / TURN_CELLS, angle = 2.0 * M_PI * turn,
                     radius = r->radius_mm - r->pitch_mm * turn;
        put_point(m, TAIL_CELLS + i, (double[2]){-radius * sin(angle), -radius * cos(angle)}, 2);
    }
    centre(m);
    return STATUS_OK;
}

/* Depths differ by a slower wave, so that no two folds look alike. */
static double fold_angle(const struct mesh_folds *f, double turn)
{
    return f->angle_rad * (0.8 + 0.2 * sin(0.61 * turn)) * sin(turn + 0.35 * sin(0.37 * turn));
}

status mesh_folds_make(const struct mesh_folds *f, struct mesh *m, struct error *err)
{
    const size_t n = f->n_fold * FOLD_CELLS;
    if (!(f->width_mm > 0.0 && f->height_mm > 0.0 && f->angle_rad >= 0.0 && f->angle_rad < 1.5) || f->n_fold == 0 ||
        f->n_fold > MOST_FOLDS)
        return error_set(err, STATUS_INVALID, "cannot hang a cloth of %g x %g mm in %zu folds of %g rad", f->width_mm,
                         f->height_mm, f->n_fold, f->angle_rad);
    status s = new_strip(n, f->height_mm, m, err);
    if (s != STATUS_OK) return s;
    double at[2] = {0.0, 0.0};
    for (size_t i = 0; i <= n; i++) {
        put_point(m, i, at, 1);
        const double angle = fold_angle(f, 2.0 * M_PI * ((double)i + 0.5) / FOLD_CELLS);
        at[0] += f->width_mm / (double)n * cos(angle);
        at[1] += f->width_mm / (double)n * sin(angle);
    }
    centre(m);
    return STATUS_OK;
}
