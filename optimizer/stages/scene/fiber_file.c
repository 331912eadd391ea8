#include "optimizer/stages/scene/fiber_file.h"
#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "geometry/fibers/fiber_import.h"
#include "optimizer/job/options/option_key.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double mm = 1e-3, um = 1e-6;
/* Extent of the fibers over the tile. Yarns of a tile run over its edges by a yarn width at most; a tile that fibers
 * leave empty has gaps that no cloth has. */
static const double least_filled = 0.4, most_filled = 3.0;

/* Refuses fibers as wide as their tile, which no cloth has. A length in a wrong unit makes such fibers; all of them
 * meet across the faces, and the pairs of their ends would be too many to search. */
static status check_radii(const struct fiber_set *f, const char *name, struct error *err)
{
    double most_m = 0.5 * fmin(f->tile_size_m[0], f->tile_size_m[1]);
    for (size_t i = 0; i < f->n_fiber; i++)
        if ((double)f->radius_m[i] > most_m)
            return error_set_field(
                err, STATUS_INVALID, OPTION_FIBER_FILE,
                "cannot use fibers '%s': fiber %zu has a radius of %g mm, the tile is %g x %g mm: the unit may "
                "be wrong, lengths are millimetres",
                name, i, (double)f->radius_m[i] / mm, f->tile_size_m[0] / mm, f->tile_size_m[1] / mm);
    return STATUS_OK;
}

void fiber_file_note(const char *path, const struct job_cloth *cloth, json_t *files)
{
    double tile_m[2];
    struct file_ledger ledger = {0};
    const bool given = !isnan(cloth->tile_mm[0]);
    fiber_import_statements(path, &ledger, tile_m);
    if (tile_m[0] > 0.0)
        file_ledger_add(&ledger, "tile", given ? "the job states it" : NULL, "%g x %g mm", tile_m[0] / mm,
                        tile_m[1] / mm);
    file_ledger_append(files, cloth->fiber_file, &ledger);
}

status fiber_file_read(const char *path, const struct job_cloth *cloth, struct fiber_set *f, struct error *err)
{
    const char *name = cloth->fiber_file;
    const struct fiber_file_terms terms = {.radius_m = cloth->fiber_radius_um * um, .ledger = NULL};
    status s = fiber_import(f, path, &terms, err);
    if (s != STATUS_OK) {
        if (err != NULL && err->field[0] == '\0') snprintf(err->field, sizeof err->field, OPTION_FIBER_FILE);
        return s;
    }
    for (int a = 0; a < 2; a++)
        if (!isnan(cloth->tile_mm[a])) f->tile_size_m[a] = cloth->tile_mm[a] * mm;
    if (!(f->tile_size_m[0] > 0.0 && f->tile_size_m[1] > 0.0))
        return error_set_field(err, STATUS_INVALID, OPTION_TILE,
                               "'%s' is missing: the file '%s' does not say with which period the cloth repeats",
                               job_option_key(OPTION_TILE), name);
    fiber_set_classify(f);
    s = fiber_set_validate(f, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_FIBER_FILE);
    return s == STATUS_OK ? check_radii(f, name, err) : s;
}

void fiber_file_warn_diameter(double diameter_m, const char *option, const struct warning_sink *warn)
{
    double d_um = diameter_m / um;
    if (d_um >= FIBER_LEAST_DIAMETER_UM && d_um <= FIBER_MOST_DIAMETER_UM) return;
    warning_send(warn, option,
                 "the fibers have a mean diameter of %.3g um, textile fibers have %g to %g um: a length may be in a "
                 "wrong unit",
                 d_um, FIBER_LEAST_DIAMETER_UM, FIBER_MOST_DIAMETER_UM);
}

void fiber_file_warn(const struct fiber_set *f, const struct job_cloth *cloth, const struct warning_sink *warn)
{
    double sum = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) sum += 2.0 * (double)f->radius_m[i] / (double)f->n_fiber;
    fiber_file_warn_diameter(sum, OPTION_FIBER_FILE, warn);
    for (size_t a = 0; a < 2; a++) {
        double lowest = INFINITY, highest = -INFINITY;
        for (size_t i = 0; i < f->n_vertex; i++) {
            lowest = fmin(lowest, (double)f->position_m[3 * i + a]);
            highest = fmax(highest, (double)f->position_m[3 * i + a]);
        }
        double filled = (highest - lowest) / f->tile_size_m[a];
        if (filled >= least_filled && filled <= most_filled) continue;
        warning_send(warn, isnan(cloth->tile_mm[a]) ? OPTION_FIBER_FILE : OPTION_TILE,
                     "the tile is %.4g mm along %c, the fibers extend over %.4g mm: one of both may be in a wrong unit",
                     f->tile_size_m[a] / mm, "xy"[a], (highest - lowest) / mm);
        return;
    }
}
