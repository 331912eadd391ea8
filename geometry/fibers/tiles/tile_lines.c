#include "geometry/fibers/tiles/tile_lines.h"

#include <stdlib.h>
#include <string.h>

static status refuse(struct error *err)
{
    return error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
}

static status grow_lines(struct tile_lines *l, size_t room, struct error *err)
{
    size_t *first = realloc(l->first, (room + 1) * sizeof *first);
    if (first != NULL) l->first = first;
    size_t *source = realloc(l->source, room * sizeof *source);
    if (source != NULL) l->source = source;
    bool(*is_cut)[2] = realloc(l->is_cut, room * sizeof *is_cut);
    if (is_cut != NULL) l->is_cut = is_cut;
    if (first == NULL || source == NULL || is_cut == NULL) return refuse(err);
    l->line_room = room;
    return STATUS_OK;
}

status tile_lines_init(struct tile_lines *l, struct error *err)
{
    *l = (struct tile_lines){0};
    status s = grow_lines(l, 1024, err);
    if (s == STATUS_OK) l->first[0] = 0;
    return s;
}

void tile_lines_release(struct tile_lines *l)
{
    free(l->first);
    free(l->source);
    free(l->is_cut);
    free(l->vertex);
    memset(l, 0, sizeof *l);
}

status tile_lines_add(struct tile_lines *l, const struct tile_vertex *v, struct error *err)
{
    if (l->n_vertex == l->vertex_room) {
        const size_t room = 2 * l->vertex_room + 4096;
        struct tile_vertex *vertex = realloc(l->vertex, room * sizeof *vertex);
        if (vertex == NULL) return refuse(err);
        l->vertex = vertex;
        l->vertex_room = room;
    }
    l->vertex[l->n_vertex++] = *v;
    return STATUS_OK;
}

status tile_lines_end(struct tile_lines *l, size_t source, bool first_is_cut, bool last_is_cut, struct error *err)
{
    if (l->n_vertex - l->first[l->n_line] < 2) {
        l->n_vertex = l->first[l->n_line];
        return STATUS_OK;
    }
    if (l->n_line == l->line_room) {
        status s = grow_lines(l, 2 * l->line_room, err);
        if (s != STATUS_OK) return s;
    }
    l->source[l->n_line] = source;
    l->is_cut[l->n_line][0] = first_is_cut;
    l->is_cut[l->n_line][1] = last_is_cut;
    l->first[++l->n_line] = l->n_vertex;
    return STATUS_OK;
}

status tile_lines_take(const struct tile_lines *l, const double tile_m[2], struct fiber_set *f, struct error *err)
{
    struct fiber_set made;
    fiber_set_init(&made);
    status s = fiber_set_reserve(&made, l->n_line, l->n_vertex, err);
    if (s == STATUS_OK && f->shape != NULL) s = fiber_set_add_shapes(&made, err);
    if (s != STATUS_OK) {
        fiber_set_release(&made);
        return s;
    }
    memcpy(made.tile_size_m, tile_m, sizeof made.tile_size_m);
    memcpy(made.first_vertex, l->first, (l->n_line + 1) * sizeof *l->first);
    for (size_t i = 0; i < l->n_line; i++) {
        made.radius_m[i] = f->radius_m[l->source[i]];
        made.axis_class[i] = f->axis_class[l->source[i]];
        made.group[i] = f->group[l->source[i]];
    }
    for (size_t k = 0; k < l->n_vertex; k++) {
        for (int a = 0; a < 3; a++) made.position_m[3 * k + (size_t)a] = (float)l->vertex[k].p[a];
        if (made.shape != NULL) made.shape[k] = l->vertex[k].shape;
    }
    fiber_set_release(f);
    *f = made;
    return STATUS_OK;
}
