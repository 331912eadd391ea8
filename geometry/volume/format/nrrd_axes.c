#include "geometry/volume/format/nrrd_axes.h"
#include "geometry/volume/format/length_unit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double DEFAULT_M = 1e-3; /* lengths without a unit are taken for millimetres */

void nrrd_axes_init(struct nrrd_axes *m)
{
    *m = (struct nrrd_axes){.all.source = "its header"};
    for (int a = 0; a < HEADER_MAX_AXIS; a++) m->spacing[a] = m->least[a] = m->most[a] = m->unit_m[a] = NAN;
    for (int w = 0; w < 3; w++) m->space_unit_m[w] = NAN;
}

static status bad(const struct volume_header *h, const char *what, const char *value, struct error *err)
{
    return volume_header_refuse(h, what, value, err);
}

static status parse_dimension(struct nrrd_axes *m, const struct volume_header *h, const char *value, struct error *err)
{
    char *end;
    const long n = strtol(value, &end, 10);
    if (*end != '\0' || n < 3 || n > HEADER_MAX_AXIS) return bad(h, "dimension must be 3 (or 4 to 6), not", value, err);
    m->n = (size_t)n;
    return STATUS_OK;
}

static status parse_sizes(struct nrrd_axes *m, const struct volume_header *h, const char *value, struct error *err)
{
    static const char complaint[] = "sizes are not three positive numbers, or one for each dimension:";
    const char *end;
    status s = volume_header_sizes(h, value, m->n, m->all.size, complaint, &end, err);
    if (s == STATUS_OK && end[strspn(end, " \t")] != '\0') return bad(h, complaint, value, err);
    m->has_size = true;
    return s;
}

/* A number for each axis. NaN ("nan", "none") for one that has none: the job must give it. */
static status parse_numbers(const struct nrrd_axes *m, const struct volume_header *h, const char *value, double *number,
                            const char *complaint, struct error *err)
{
    const char *p = value;
    for (size_t a = 0; a < m->n; a++) {
        char *end;
        number[a] = strtod(p, &end);
        if (end == p || isinf(number[a])) return bad(h, complaint, value, err);
        p = end;
    }
    return STATUS_OK;
}

static status parse_spacings(struct nrrd_axes *m, const struct volume_header *h, const char *value, struct error *err)
{
    static const char complaint[] = "spacings are not three positive numbers:";
    status s = parse_numbers(m, h, value, m->spacing, complaint, err);
    for (size_t a = 0; a < m->n && s == STATUS_OK; a++) {
        if (m->spacing[a] == 0.0) return bad(h, complaint, value, err);
        m->spacing[a] = fabs(m->spacing[a]);
    }
    return s;
}

/* "(0.002,0,0) (0,0.002,0) none": the edges of a voxel in space; "none" for an axis that is not of space. */
static status parse_directions(struct nrrd_axes *m, const struct volume_header *h, const char *value, struct error *err)
{
    const char *p = value;
    for (size_t a = 0; a < m->n; a++) {
        double square = 0.0;
        p += strspn(p, " \t");
        if (strncasecmp(p, "none", 4) == 0) {
            p += 4;
            continue;
        }
        if (*p++ != '(') return bad(h, "space directions are not three vectors:", value, err);
        for (int c = 0; c < 3; c++) {
            char *end;
            double x = strtod(p, &end);
            bool given = end != p && isfinite(x);
            p = end + strspn(end, " \t");
            if (!given || *p != (c < 2 ? ',' : ')'))
                return bad(h, "space directions are not three vectors:", value, err);
            p++;
            square += x * x;
            m->all.direction[a][c] = x;
        }
        if (!(square > 0.0) || !isfinite(square)) return bad(h, "a space direction has no length:", value, err);
    }
    m->all.has_direction = true;
    return STATUS_OK;
}

/* For example "\"mm\" \"mm\" \"mm\"". */
static status parse_units(const struct volume_header *h, const char *value, size_t n, double *unit_m, struct error *err)
{
    const char *p = value;
    for (size_t a = 0; a < n; a++) {
        const char *open = strchr(p, '"'), *close = open != NULL ? strchr(open + 1, '"') : NULL;
        if (close == NULL) return bad(h, "units are not three quoted words:", value, err);
        unit_m[a] = close == open + 1 ? DEFAULT_M : length_unit_m(open + 1, (size_t)(close - open - 1));
        if (isnan(unit_m[a]) && n <= 3) return bad(h, "unknown unit of length in", value, err);
        p = close + 1;
    }
    return STATUS_OK;
}

static status parse_kinds(struct nrrd_axes *m, const char *value)
{
    static const struct {
        const char *name;
        enum header_axis_kind kind;
    } known[] = {{"domain", AXIS_SPACE},    {"space", AXIS_SPACE},     {"time", AXIS_TIME},
                 {"???", AXIS_UNKNOWN},     {"none", AXIS_UNKNOWN},    {"RGB-color", AXIS_COLOR},
                 {"HSV-color", AXIS_COLOR}, {"XYZ-color", AXIS_COLOR}, {"RGBA-color", AXIS_COLOR},
                 {"3-color", AXIS_COLOR},   {"4-color", AXIS_COLOR}};
    for (size_t a = 0; a < m->n; a++) {
        value += strspn(value, " \t");
        const size_t n = strcspn(value, " \t");
        if (n == 0) break;
        m->all.kind[a] = AXIS_CHANNEL; /* lists, vectors, matrices */
        for (size_t i = 0; i < sizeof known / sizeof *known; i++)
            if (strlen(known[i].name) == n && strncasecmp(known[i].name, value, n) == 0) m->all.kind[a] = known[i].kind;
        value += n;
    }
    m->has_kind = true;
    return STATUS_OK;
}

static status parse_centers(struct nrrd_axes *m, const char *value)
{
    for (size_t a = 0; a < m->n; a++) {
        value += strspn(value, " \t");
        m->is_node[a] = strncasecmp(value, "node", 4) == 0;
        value += strcspn(value, " \t");
    }
    return STATUS_OK;
}

static bool is(const char *key, const char *name) { return strcasecmp(key, name) == 0; }

/* Spaces whose x, y and z are left-handed. */
static bool is_left_handed(const char *space)
{
    return strncasecmp(space, "left-anterior-superior", 22) == 0 || strncasecmp(space, "LAS", 3) == 0 ||
           strncasecmp(space, "3D-left-handed", 14) == 0;
}

static void state_other(struct file_ledger *ledger, const char *key, const char *value)
{
    if (is(key, "space origin"))
        file_ledger_add(ledger, "origin", "the cloth begins at the corner of the scan", "%s", value);
    if (is(key, "labels")) file_ledger_add(ledger, "labels of axes", "names are no directions", "%s", value);
    if (is(key, "thicknesses")) file_ledger_add(ledger, "thickness of slices", "only distances count", "%s", value);
    if (is(key, "old min") || is(key, "oldmin") || is(key, "min"))
        file_ledger_add(ledger, "smallest value", "void and solid come from the histogram", "%s", value);
    if (is(key, "old max") || is(key, "oldmax") || is(key, "max"))
        file_ledger_add(ledger, "largest value", "void and solid come from the histogram", "%s", value);
}

status nrrd_axes_parse(struct nrrd_axes *m, const struct volume_header *h, const char *key, const char *value,
                       struct file_ledger *ledger, struct error *err)
{
    if (is(key, "dimension")) return parse_dimension(m, h, value, err);
    if (m->n == 0) return STATUS_OK; /* the dimension comes before all fields of axes */
    if (is(key, "sizes")) return parse_sizes(m, h, value, err);
    if (is(key, "spacings")) return parse_spacings(m, h, value, err);
    if (is(key, "space directions")) return parse_directions(m, h, value, err);
    if (is(key, "space units")) return parse_units(h, value, 3, m->space_unit_m, err);
    if (is(key, "units")) return parse_units(h, value, m->n, m->unit_m, err);
    if (is(key, "kinds")) return parse_kinds(m, value);
    if (is(key, "centers") || is(key, "centerings")) return parse_centers(m, value);
    if (is(key, "axis mins") || is(key, "axismins"))
        return parse_numbers(m, h, value, m->least, "axis mins are no numbers:", err);
    if (is(key, "axis maxs") || is(key, "axismaxs"))
        return parse_numbers(m, h, value, m->most, "axis maxs are no numbers:", err);
    if (is(key, "space")) m->left_handed = is_left_handed(value);
    state_other(ledger, key, value);
    return STATUS_OK;
}

void nrrd_state_pair(struct volume_source_info *info, const char *key, const char *value)
{
    static const char *const of_voxels[] = {"voxel", "spacing", "resolution", "pixel", "unit", "channel", "axis"};
    static const char *const of_padding[] = {"padding", "nodata", "no_data", "no data", "missing value"};
    char *end, name[32] = "key ";
    value += strspn(value, " \t");
    for (size_t i = 0; i < sizeof of_padding / sizeof *of_padding; i++) {
        if (strcasestr(key, of_padding[i]) == NULL) continue;
        const double v = strtod(value, &end);
        if (end != value) info->padding = v;
        return;
    }
    strncat(name, key, sizeof name - 5);
    for (size_t i = 0; i < sizeof of_voxels / sizeof *of_voxels; i++)
        if (strcasestr(key, of_voxels[i]) != NULL)
            file_ledger_add(&info->ledger, name, "the format has fields for lengths and axes", "%s", value);
}

/* Returns the first unit that is stated. */
static double unit_of(double first_m, double second_m)
{
    if (!isnan(first_m)) return first_m;
    return isnan(second_m) ? DEFAULT_M : second_m;
}

/* Edge of a voxel along an axis without a direction, in metres. */
static double edge_m(const struct nrrd_axes *m, size_t a)
{
    const double n = (double)m->all.size[a] - (m->is_node[a] ? 1.0 : 0.0);
    const double by_range = n > 0.0 ? fabs(m->most[a] - m->least[a]) / n : NAN;
    const double edge =
        (isnan(m->spacing[a]) ? by_range : m->spacing[a]) * unit_of(m->unit_m[a], m->space_unit_m[a % 3]);
    return edge > 0.0 ? edge : NAN;
}

status nrrd_axes_settle(struct nrrd_axes *m, struct volume_header *h, const struct volume_part *part,
                        struct volume_source_info *info, struct error *err)
{
    m->all.n = m->n;
    for (size_t a = 0; a < m->n; a++) {
        double *d = m->all.direction[a];
        for (int w = 0; w < 3; w++) d[w] *= unit_of(m->space_unit_m[w], m->unit_m[w]);
        if (m->left_handed) d[1] = -d[1];
        const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        if (m->all.has_direction && m->all.kind[a] == AXIS_UNKNOWN)
            m->all.kind[a] = length > 0.0 ? AXIS_SPACE : AXIS_CHANNEL;
        m->all.spacing_m[a] = m->all.has_direction && length > 0.0 ? length : edge_m(m, a);
    }
    return header_axes_settle(&m->all, h, part, info, err);
}
