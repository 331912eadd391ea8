#include "optimizer/stages/scene/draft_file.h"
#include "base/catalogue/cloth_description.h"
#include "base/option_id.h"
#include "geometry/weave/weave_wif.h"

#include <stdio.h>
#include <string.h>

static status name_file(status s, struct error *err)
{
    if (s != STATUS_OK && err != NULL && (err->field[0] == '\0' || strcmp(err->field, "draft") == 0))
        snprintf(err->field, sizeof err->field, OPTION_DRAFT_FILE);
    else if (s == STATUS_INVALID)
        job_cloth_name_field(err);
    return s;
}

status draft_file_take(const char *path, const struct job_cloth *cloth, struct file_ledger *ledger, struct error *err)
{
    struct cloth_description *d = cloth->description;
    struct weave_wif w;
    const char *row[WEAVE_WIF_MOST];
    status s = weave_wif_read(path, &w, ledger, err);
    if (s != STATUS_OK) return name_file(s, err);
    for (size_t j = 0; j < w.n_weft; j++) row[j] = w.row[j];
    s = cloth_description_draft(d, row, w.n_weft, err);
    for (int a = CLOTH_WEFT; a <= CLOTH_WARP; a++) d->n_yarn[a] = cloth->tile_yarn[a];
    if (s == STATUS_OK) s = cloth_description_check(d, err);
    if (s == STATUS_OK) s = job_cloth_check_final_tiles(cloth, err);
    return name_file(s, err);
}
