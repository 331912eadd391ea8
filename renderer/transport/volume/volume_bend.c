#include "renderer/transport/volume/volume_bent.h"

#include <stdlib.h>
#include <string.h>

#define MARGIN_MM 1e-3

status volume_scene_bend(const struct volume_scene *flat, const struct mesh *mesh, bool black_sheet,
                         struct volume_scene *bent, struct error *err)
{
    const double thickness_mm = (double)((flat->high - flat->low) * flat->voxel_mm[2]);
    *bent = *flat;
    bent->black_sheet = black_sheet;
    bent->bent = calloc(1, sizeof *bent->bent);
    if (bent->bent == NULL) {
        memset(bent, 0, sizeof *bent);
        return error_set(err, STATUS_NO_MEMORY, "cannot bend the cloth: out of memory");
    }
    return shell_space_init(&bent->bent->space, mesh, thickness_mm, MARGIN_MM, err);
}

void volume_bent_release(struct volume_scene *bent)
{
    shell_space_release(&bent->bent->space);
    free(bent->bent);
    memset(bent, 0, sizeof *bent);
}
