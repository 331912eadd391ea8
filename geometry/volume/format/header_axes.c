#include "geometry/volume/format/header_axes.h"
#include "base/option_id.h"
#include "geometry/volume/format/axis_directions.h"
#include "geometry/volume/format/length_unit.h"

#include <math.h>
#include <string.h>

static status refuse(const struct volume_header *h, const char *text, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s", h->name, text);
}

/* Says what the axes are whose kind the header does not state: three are of space, and others of one voxel are none; of
 * more, the first one is of channels if it is short, and else the last ones are. */
static void name_unknown(struct header_axes *axes)
{
    size_t n_space = 0, n_open = 0;
    for (size_t a = 0; a < axes->n; a++) {
        n_space += axes->kind[a] == AXIS_SPACE;
        n_open += axes->kind[a] == AXIS_UNKNOWN;
    }
    size_t more = n_space + n_open > 3 ? n_space + n_open - 3 : 0; /* axes that are not of space */
    if (more > 0 && axes->kind[0] == AXIS_UNKNOWN && axes->size[0] <= 4 && axes->size[axes->n - 1] > axes->size[0]) {
        axes->kind[0] = AXIS_CHANNEL;
        more--;
    }
    for (size_t a = axes->n; a-- > 0;)
        if (axes->kind[a] == AXIS_UNKNOWN) {
            axes->kind[a] = more == 0 ? AXIS_SPACE : axes->n == 4 || more == 1 ? AXIS_CHANNEL : AXIS_TIME;
            more -= more > 0;
        }
}

/* Adds an axis of `n` volumes that is slower than the axes in `parts`. Volume i is read. */
static void add_part(struct voxel_parts *parts, size_t n, size_t i)
{
    const size_t before = parts->n > 1 ? parts->n : 1;
    parts->i += i * before;
    parts->n = n * before;
}

static status find_parts(const struct header_axes *axes, struct volume_header *h, const struct volume_part *part,
                         struct file_ledger *ledger, struct error *err)
{
    struct volume_parts parts = {{0, 0}, axes->source};
    size_t index[2], n_space = 0;
    for (size_t a = 0; a < axes->n; a++) {
        if (axes->kind[a] == AXIS_COLOR)
            return refuse(h, "it is a volume of colors: save its densities as one grey value a voxel", err);
        if (axes->kind[a] == AXIS_SPACE || axes->size[a] == 1) continue;
        size_t *n = &parts.n[axes->kind[a] == AXIS_TIME ? VOLUME_TIMES : VOLUME_CHANNELS];
        if (*n > 0) return refuse(h, "it has several axes of channels or of times: save one volume", err);
        *n = axes->size[a];
    }
    status s = volume_part_choose(h->name, &parts, part, index, ledger, err);
    for (size_t a = 0; a < axes->n && s == STATUS_OK; a++) {
        struct voxel_layout *l = &h->layout;
        if (axes->kind[a] == AXIS_SPACE && n_space == 3) return refuse(h, "it has more than three axes of space", err);
        if (axes->kind[a] == AXIS_SPACE) {
            l->n[n_space++] = axes->size[a];
            continue;
        }
        const size_t i = axes->size[a] == 1 ? 0 : index[axes->kind[a] == AXIS_TIME ? VOLUME_TIMES : VOLUME_CHANNELS];
        if (n_space == 1 && axes->size[a] > 1)
            return refuse(h, "its channels or times lie between columns and rows: save them behind one another", err);
        add_part(n_space == 0 ? &l->by_sample : n_space < 3 ? &l->by_slice : &l->by_volume, axes->size[a], i);
    }
    if (s == STATUS_OK && n_space < 3) return refuse(h, "it has fewer than three axes of space", err);
    return s;
}

void header_axes_matrix(double direction[3][3], double matrix[9])
{
    for (int a = 0; a < 3; a++) {
        const double *d = direction[a], length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        for (int w = 0; w < 3; w++) matrix[3 * w + a] = d[w] / length;
    }
}

static void state_directions(double direction[3][3], struct volume_source_info *info)
{
    double *m = info->oblique;
    if (axis_directions_name(direction, info->axes)) {
        file_ledger_add(&info->ledger, "directions of axes", NULL, "%s", info->axes);
        return;
    }
    info->is_oblique = true;
    header_axes_matrix(direction, m);
    file_ledger_add(&info->ledger, "directions of axes", NULL,
                    "oblique: (%.3g %.3g %.3g) (%.3g %.3g %.3g) (%.3g %.3g %.3g)", m[0], m[3], m[6], m[1], m[4], m[7],
                    m[2], m[5], m[8]);
}

status header_axes_settle(const struct header_axes *stated, struct volume_header *h, const struct volume_part *part,
                          struct volume_source_info *info, struct error *err)
{
    struct header_axes axes = *stated;
    double direction[3][3] = {{0.0}}, size_m[3] = {NAN, NAN, NAN};
    name_unknown(&axes);
    status s = find_parts(&axes, h, part, &info->ledger, err);
    if (s != STATUS_OK) return s;
    for (size_t a = 0, n = 0; a < axes.n; a++) {
        if (axes.kind[a] != AXIS_SPACE) continue;
        memcpy(direction[n], axes.direction[a], sizeof direction[n]);
        size_m[n++] = axes.spacing_m[a];
    }
    memcpy(info->n, h->layout.n, sizeof info->n);
    volume_state_voxel_size(info, size_m, "");
    if (axes.has_direction) state_directions(direction, info);
    return STATUS_OK;
}
