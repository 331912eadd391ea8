#include "renderer/glint/glint_surface.h"

#include "renderer/glint/glint_cells.h"
#include "renderer/glint/glint_draw.h"
#include "renderer/glint/glint_tables.h"

#include <stdlib.h>

struct glint_surface {
    struct glint_lattice lattice;
    struct glint_cells cells;
    struct glint_tables tables;
};

status glint_surface_new(const struct glint_option *given, struct glint_surface **out, struct error *err)
{
    struct glint_option o;
    struct glint_map map = {0};
    status code = glint_option_complete(given, &o, err);
    if (code != STATUS_OK) return code;
    struct glint_surface *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a glint surface: out of memory");
    code = glint_map_make(&o, &map, err);
    if (code == STATUS_OK) code = glint_lattice_make(&o, &map, &s->lattice, err);
    if (code == STATUS_OK) code = glint_cells_make(&s->lattice, &s->cells, err);
    if (code == STATUS_OK) code = glint_tables_make(&s->lattice, &s->tables, err);
    glint_map_release(&map);
    if (code == STATUS_OK)
        *out = s;
    else
        glint_surface_free(s);
    return code;
}

void glint_surface_free(struct glint_surface *s)
{
    if (s == NULL) return;
    glint_tables_release(&s->tables);
    glint_cells_release(&s->cells);
    glint_lattice_release(&s->lattice);
    free(s);
}

float glint_period_um(const struct glint_surface *s) { return s->lattice.period_um; }

float glint_density(const struct glint_surface *s, const struct glint_footprint *at, const float half[2])
{
    struct glint_query q;
    if (!(half[0] * half[0] + half[1] * half[1] < 1)) return 0;
    const struct glint_table_level *level = glint_tables_level(&s->tables, at);
    if (level != NULL) return glint_tables_density(&s->tables, level, at, half);
    glint_query_init(&s->lattice, at, &q);
    return q.factor * glint_cells_sum(&s->cells, &s->lattice, &q, half);
}

void glint_sample(const struct glint_surface *s, const struct glint_footprint *at, const float u[GLINT_N_NUMBER],
                  float half[2])
{
    struct glint_query q;
    const struct glint_table_level *level = glint_tables_level(&s->tables, at);
    if (level != NULL) {
        glint_tables_draw(&s->tables, level, at, u, half);
        return;
    }
    glint_query_init(&s->lattice, at, &q);
    glint_draw(&s->lattice, &q, u, half);
}

float glint_pdf(const struct glint_surface *s, const struct glint_footprint *at, const float half[2])
{
    return glint_density(s, at, half);
}
