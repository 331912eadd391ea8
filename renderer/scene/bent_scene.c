#include "renderer/scene/bent_scene.h"

#include <stdlib.h>
#include <string.h>

status scene_bend(const struct scene *flat, const struct mesh *m, bool black_sheet, struct scene **bent,
                  struct error *err)
{
    if (flat->bent != NULL) return error_set(err, STATUS_INVALID, "cannot bend a cloth that is bent already");
    struct scene *s = calloc(1, sizeof *s);
    if (s != NULL) s->bent = calloc(1, sizeof *s->bent);
    if (s == NULL || s->bent == NULL) {
        free(s);
        return error_set(err, STATUS_NO_MEMORY, "cannot bend the cloth: out of memory");
    }
    struct bent_cloth *b = s->bent;
    memcpy(s, flat, sizeof *s);
    memcpy(&b->flat, flat, sizeof b->flat);
    s->bent = b;
    s->black_sheet = black_sheet;
    status st = shell_space_init(&b->space, m, -(double)flat->bottom_mm, (double)SCENE_MARGIN_MM, err);
    if (st == STATUS_OK)
        *bent = s;
    else
        bent_free(s);
    return st;
}

void bent_free(struct scene *s)
{
    struct bent_cloth *b = s->bent;
    shell_space_release(&b->space);
    free(b);
    free(s);
}

size_t bent_memory_bytes(const struct scene *s)
{
    const struct shell *h = &s->bent->space.shell;
    return sizeof *s + sizeof *s->bent + h->n_cell * (sizeof *h->cell + sizeof *h->corner) +
           2 * h->n_node * sizeof *h->node_mm + h->n_outer * (2 * sizeof *h->outer + 64);
}
