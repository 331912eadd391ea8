#include "optimizer/fit/photographs/measurement_table.h"
#include "base/option_id.h"
#include "optimizer/fit/photographs/table/table_text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_CELL = 64, MAX_ROW = CONFIGURATION_MAX_COUNT };

enum column {
    COLUMN_SET,
    COLUMN_LIGHT_THETA,
    COLUMN_LIGHT_PHI,
    COLUMN_CAMERA_THETA,
    COLUMN_CAMERA_PHI,
    COLUMN_R,
    COLUMN_G,
    COLUMN_B,
    COLUMN_N_REQUIRED,
    COLUMN_ROTATION = COLUMN_N_REQUIRED,
    COLUMN_R_SE,
    COLUMN_G_SE,
    COLUMN_B_SE,
    COLUMN_WEIGHT,
    COLUMN_INDEX,
    COLUMN_NAME,
    COLUMN_COUNT
};

static const char *const column_name[COLUMN_COUNT + 1] = {"set",
                                                          "light_theta_deg",
                                                          "light_phi_deg",
                                                          "camera_theta_deg",
                                                          "camera_phi_deg",
                                                          "r",
                                                          "g",
                                                          "b",
                                                          "cloth_rotation_deg",
                                                          "r_se",
                                                          "g_se",
                                                          "b_se",
                                                          "weight",
                                                          "index",
                                                          "name",
                                                          NULL};

struct table {
    const char *file;
    const struct job_document *doc;
    size_t line;
    char separator; /* '\0' before the header or Excel's line "sep=;" has set it */
    size_t n_column;
    int column[MAX_CELL];    /* which enum column the file's column i is */
    int place[COLUMN_COUNT]; /* the file's column for an enum column, or -1 */
    char *cell[MAX_CELL];
    size_t n_cell;
    /* of the rows so far, fitted and held-out ones, which are traced together in the validation */
    size_t n_configuration;
};

#define table_error(t, code, ...)                                                                                      \
    error_set_field(err, (code), OPTION_MEASUREMENT_FILE, "cannot use table '%s': line %zu: " __VA_ARGS__)

static status split(struct table *t, char *line, struct error *err)
{
    t->n_cell = table_text_split(line, t->separator, t->cell, MAX_CELL);
    if (t->n_cell <= MAX_CELL) return STATUS_OK;
    return table_error(t, STATUS_FORMAT, "more than %d cells", t->file, t->line, MAX_CELL);
}

static status read_header(struct table *t, struct error *err)
{
    for (int c = 0; c < COLUMN_COUNT; c++) t->place[c] = -1;
    for (size_t i = 0; i < t->n_cell; i++) {
        int c = 0;
        while (c < COLUMN_COUNT && strcmp(column_name[c], t->cell[i]) != 0) c++;
        if (c == COLUMN_COUNT)
            return table_error(t, STATUS_FORMAT, "unknown column '%.60s'", t->file, t->line, t->cell[i]);
        if (t->place[c] >= 0)
            return table_error(t, STATUS_FORMAT, "column '%s' appears twice", t->file, t->line, column_name[c]);
        t->place[c] = (int)i;
        t->column[i] = c;
    }
    t->n_column = t->n_cell;
    for (int c = 0; c < COLUMN_N_REQUIRED; c++)
        if (t->place[c] < 0)
            return table_error(t, STATUS_FORMAT, "column '%s' is missing", t->file, t->line, column_name[c]);
    return STATUS_OK;
}

static status cell_number(const struct table *t, enum column c, double missing, double *out, struct error *err)
{
    *out = missing;
    if (t->place[c] < 0) return STATUS_OK;
    const char *text = t->cell[t->place[c]];
    if (!table_text_number(text, out))
        return table_error(t, STATUS_FORMAT, "column '%s': '%.40s' is not a number (write 1234.5 or 1234,5)", t->file,
                           t->line, column_name[c], text);
    if (!isfinite(*out))
        return table_error(t, STATUS_INVALID, "column '%s' is '%.40s': it must be finite", t->file, t->line,
                           column_name[c], text);
    return STATUS_OK;
}

static status cell_angle(const struct table *t, enum column c, double lower, double upper, double *out,
                         struct error *err)
{
    status s = cell_number(t, c, 0.0, out, err);
    if (s != STATUS_OK) return s;
    if (*out < lower || *out > upper)
        return table_error(t, STATUS_INVALID, "column '%s' is %g degrees: allowed are %g to %g", t->file, t->line,
                           column_name[c], *out, lower, upper);
    return STATUS_OK;
}

/* Reads the rotation. "all" in place of the angle: the row is a mean over all rotations of the cloth. */
static status cell_rotation(const struct table *t, double *out_deg, uint32_t *n_rotation, struct error *err)
{
    int place = t->place[COLUMN_ROTATION];
    bool all = place >= 0 && strcmp(t->cell[place], "all") == 0;
    *out_deg = 0.0;
    *n_rotation = all ? CONFIGURATION_ALL_ROTATIONS : 0;
    return all ? STATUS_OK : cell_angle(t, COLUMN_ROTATION, -360.0, 360.0, out_deg, err);
}

static status cell_polar(const struct table *t, enum column c, bool may_be_behind, double *out, struct error *err)
{
    status s = cell_number(t, c, 0.0, out, err);
    if (s != STATUS_OK) return s;
    if (*out >= 0.0 && (*out < 90.0 || (may_be_behind && *out > 90.0 && *out <= 180.0))) return STATUS_OK;
    return table_error(t, STATUS_INVALID,
                       "column '%s' is %g degrees: allowed are 0 to below 90 degrees from the normal", t->file, t->line,
                       column_name[c], *out);
}

static status cell_not_negative(const struct table *t, enum column c, double missing, double upper, double *out,
                                struct error *err)
{
    status s = cell_number(t, c, missing, out, err);
    if (s != STATUS_OK) return s;
    if (*out < 0.0 || *out > upper)
        return table_error(t, STATUS_INVALID, "column '%s' is %g: allowed are 0 to %g", t->file, t->line,
                           column_name[c], *out, upper);
    return STATUS_OK;
}

/* Names a row: the name given, with '_' for bytes that a file name cannot have, because pictures are named after
 * rows; without one "fit-03". */
static void row_name(const struct table *t, const struct observation_set *o, struct observation *item)
{
    const char *given = t->place[COLUMN_NAME] >= 0 ? t->cell[t->place[COLUMN_NAME]] : "";
    const char *kind = item->set == JOB_SET_FIT ? "fit" : "held-out";
    if (given[0] == '\0')
        snprintf(item->name, sizeof item->name, "%s-%02zu", kind, observation_set_count(o, item->set));
    else
        job_file_name_make_valid(given, item->name);
}

static status count_configurations(struct table *t, uint32_t n_rotation, struct error *err)
{
    t->n_configuration += n_rotation > 1 ? n_rotation : 1;
    if (t->n_configuration <= CONFIGURATION_MAX_COUNT) return STATUS_OK;
    return table_error(t, STATUS_TOO_LARGE,
                       "more than %d renderings for fitted and held-out rows together: a row with cloth_rotation_deg "
                       "'all' takes %d, so at most %d such rows, any other row takes one",
                       t->file, t->line, CONFIGURATION_MAX_COUNT, CONFIGURATION_ALL_ROTATIONS,
                       CONFIGURATION_MAX_COUNT / CONFIGURATION_ALL_ROTATIONS);
}

static status read_row(struct table *t, struct observation_set *o, struct error *err)
{
    if (t->n_cell != t->n_column)
        return table_error(t, STATUS_FORMAT, "%zu cells, but the header has %zu columns", t->file, t->line, t->n_cell,
                           t->n_column);
    if (o->n >= MAX_ROW) return table_error(t, STATUS_TOO_LARGE, "more than %d rows", t->file, t->line, MAX_ROW);
    struct observation item = {0};
    const char *set = t->cell[t->place[COLUMN_SET]];
    if (strcmp(set, "fit") == 0)
        item.set = JOB_SET_FIT;
    else if (strcmp(set, "held-out") == 0)
        item.set = JOB_SET_HELD_OUT;
    else
        return table_error(t, STATUS_INVALID, "column 'set' is '%.40s': allowed are fit, held-out", t->file, t->line,
                           set);
    double light_theta, light_phi, camera_theta, camera_phi, rotation;
    uint32_t n_rotation;
    status s = cell_polar(t, COLUMN_LIGHT_THETA, !t->doc->black_sheet, &light_theta, err);
    if (s == STATUS_OK) s = cell_angle(t, COLUMN_LIGHT_PHI, -360.0, 360.0, &light_phi, err);
    if (s == STATUS_OK) s = cell_polar(t, COLUMN_CAMERA_THETA, false, &camera_theta, err);
    if (s == STATUS_OK) s = cell_angle(t, COLUMN_CAMERA_PHI, -360.0, 360.0, &camera_phi, err);
    if (s == STATUS_OK) s = cell_rotation(t, &rotation, &n_rotation, err);
    if (s == STATUS_OK) s = count_configurations(t, n_rotation, err);
    for (unsigned c = 0; c < 3 && s == STATUS_OK; c++) {
        s = cell_not_negative(t, COLUMN_R + c, 0.0, 1e6, &item.mean_rgb[c], err);
        if (s == STATUS_OK) s = cell_not_negative(t, COLUMN_R_SE + c, 0.0, 1e6, &item.se_rgb[c], err);
    }
    if (s == STATUS_OK) s = cell_not_negative(t, COLUMN_WEIGHT, 1.0, 1e6, &item.weight, err);
    if (s != STATUS_OK) return s;
    item.configuration = observation_configuration(t->doc, light_theta, light_phi, camera_theta, camera_phi, rotation);
    item.configuration.n_rotation = n_rotation;
    row_name(t, o, &item);
    return observation_set_append(o, &item, err);
}

/* Whether a line has separators alone. */
static bool is_empty(const struct table *t)
{
    for (size_t i = 0; i < t->n_cell; i++)
        if (t->cell[i][0] != '\0') return false;
    return true;
}

/* Reads a comment, an empty line, the header or a row. */
static status read_line(struct table *t, char *line, bool *header, struct observation_set *o, struct error *err)
{
    size_t first = strspn(line, " \t\r");
    if (line[first] == '\0' || line[first] == '#') return STATUS_OK;
    if (t->separator == '\0') {
        if (table_text_is_separator_line(line, &t->separator)) return STATUS_OK;
        t->separator = table_text_separator(line);
    }
    status s = split(t, line, err);
    if (s != STATUS_OK || is_empty(t)) return s;
    while (t->n_cell > t->n_column && t->cell[t->n_cell - 1][0] == '\0') t->n_cell--; /* of spreadsheet programs */
    s = *header ? read_row(t, o, err) : read_header(t, err);
    *header = true;
    return s;
}

status measurement_table_parse(const char *text, size_t n_bytes, const char *name, const struct job_document *doc,
                               struct observation_set *o, struct error *err)
{
    struct table t = {.file = name, .doc = doc};
    status s = STATUS_OK;
    bool header = false;
    if (table_text_is_utf16(text, n_bytes))
        return error_set_field(err, STATUS_FORMAT, OPTION_MEASUREMENT_FILE,
                               "cannot use table '%s': it is UTF-16 text: save it as CSV UTF-8", name);
    char *copy = malloc(n_bytes + 1);
    if (copy == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read table '%s': out of memory", name);
    memcpy(copy, text, n_bytes);
    copy[n_bytes] = '\0';
    if (strlen(copy) != n_bytes)
        s = error_set_field(err, STATUS_FORMAT, OPTION_MEASUREMENT_FILE,
                            "cannot use table '%s': it is not text (zero byte)", name);
    for (char *p = table_text_begin(copy); s == STATUS_OK && p != NULL && *p != '\0';) {
        char *end = strchr(p, '\n'), *line = p;
        if (end != NULL) *end = '\0';
        p = end != NULL ? end + 1 : NULL;
        t.line++;
        s = read_line(&t, line, &header, o, err);
    }
    if (s == STATUS_OK && !header)
        s = error_set_field(err, STATUS_FORMAT, OPTION_MEASUREMENT_FILE, "cannot use table '%s': it has no header line",
                            name);
    else if (s == STATUS_OK && observation_set_count(o, JOB_SET_FIT) == 0)
        s = error_set_field(err, STATUS_INVALID, OPTION_MEASUREMENT_FILE,
                            "cannot use table '%s': it has no row of the set 'fit'", name);
    free(copy);
    return s;
}
