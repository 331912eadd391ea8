#include "optimizer/photographs/camera/chart_reference.h"

#include "base/files/durable.h"
#include "optimizer/photographs/camera/color_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { MAX_TABLE_BYTES = 1 << 16 };

static const double reference_lab[2][COLOR_CHART_PATCHES][3] = {
    {
        /* made before November 2014 */
        {37.986, 13.555, 14.059},  {65.711, 18.130, 17.810},   {49.927, -4.880, -21.925}, {43.139, -13.095, 21.905},
        {55.112, 8.844, -25.399},  {70.719, -33.397, -0.199},  {62.661, 36.067, 57.096},  {40.020, 10.410, -45.964},
        {51.124, 48.239, 16.248},  {30.325, 22.976, -21.587},  {72.532, -23.709, 57.255}, {71.941, 19.363, 67.857},
        {28.778, 14.179, -50.297}, {55.261, -38.342, 31.370},  {42.101, 53.378, 28.190},  {81.733, 4.039, 79.819},
        {51.935, 49.986, -14.574}, {51.038, -28.631, -28.638}, {96.539, -0.425, 1.186},   {81.257, -0.638, -0.335},
        {66.766, -0.734, -0.504},  {50.867, -0.153, -0.270},   {35.656, -0.421, -1.231},  {20.461, -0.079, -0.973},
    },
    {
        /* made in November 2014 or later */
        {37.54, 14.37, 14.92},  {64.66, 19.27, 17.50},   {49.32, -3.82, -22.54}, {43.46, -12.74, 22.72},
        {54.94, 9.61, -24.79},  {70.48, -32.26, -0.37},  {62.73, 35.83, 56.50},  {39.43, 10.75, -45.17},
        {50.57, 48.64, 16.67},  {30.10, 22.54, -20.87},  {71.77, -24.13, 58.19}, {71.51, 18.24, 67.37},
        {28.37, 15.42, -49.80}, {54.38, -39.72, 32.27},  {42.43, 51.05, 28.62},  {81.80, 2.67, 80.41},
        {50.63, 51.28, -14.12}, {49.57, -29.71, -28.32}, {95.19, -1.03, 2.93},   {81.29, -0.57, 0.44},
        {66.89, -0.75, -0.06},  {50.76, -0.13, 0.14},    {35.63, -0.46, -0.48},  {20.64, 0.07, -0.46},
    },
};

static double from_lab(double f) { return f > 6.0 / 29.0 ? f * f * f : (116.0 * f - 16.0) * 27.0 / 24389.0; }

static const double white_d50[3] = {0.96422, 1.0, 0.82521};

/* Linear sRGB, adapted to D65 by Bradford (Lindbloom), of X, Y, Z under D50 with Y of 1 for white. */
static void rgb_of_xyz(const double xyz[3], double rgb[3])
{
    static const double to_rgb[9] = {3.1338561, -1.6168667, -0.4906146, -0.9787684, 1.9161415,
                                     0.0334540, 0.0719453,  -0.2289914, 1.4052427};
    color_matrix_apply(to_rgb, xyz, rgb);
}

static void rgb_of_lab(const double lab[3], double rgb[3])
{
    double fy = (lab[0] + 16.0) / 116.0;
    double xyz[3] = {white_d50[0] * from_lab(fy + lab[1] / 500.0), white_d50[1] * from_lab(fy),
                     white_d50[2] * from_lab(fy - lab[2] / 200.0)};
    rgb_of_xyz(xyz, rgb);
}

void color_chart_reference(bool from_2014, size_t i, double rgb[3]) { rgb_of_lab(reference_lab[from_2014][i], rgb); }

/* ---- tables ---- */

struct table {
    const char *name;
    size_t column[3], n_row, i_line; /* columns of L, a, b or of X, Y, Z */
    bool is_xyz, has_head;
};

/* The next field of a line, without blanks and quotes around it; NULL at the end. */
static char *next_field(char **rest)
{
    char *field = strsep(rest, ",;\t");
    if (field == NULL) return NULL;
    field += strspn(field, " \"");
    size_t n = strlen(field);
    while (n > 0 && strchr(" \"\r", field[n - 1]) != NULL) n--;
    field[n] = '\0';
    return field;
}

static status read_head(struct table *t, char *line, struct error *err)
{
    static const char *const names[2][3] = {{"L", "a", "b"}, {"X", "Y", "Z"}};
    static const char *const prefix[2] = {"LAB_", "XYZ_"};
    size_t found[2] = {0, 0}, column[2][3] = {{0}}, i = 0;
    for (char *field; (field = next_field(&line)) != NULL; i++)
        for (size_t k = 0; k < 6; k++) {
            const char *own = strncasecmp(field, prefix[k / 3], 4) == 0 ? field + 4 : field;
            if (strncasecmp(own, names[k / 3][k % 3], 1) != 0 || (own[1] != '\0' && own[1] != '*')) continue;
            column[k / 3][k % 3] = i;
            found[k / 3] |= (size_t)1 << k % 3;
        }
    t->is_xyz = found[0] != 7;
    t->has_head = true;
    memcpy(t->column, column[t->is_xyz], sizeof t->column);
    if (found[0] == 7 || found[1] == 7) return STATUS_OK;
    return error_set(err, STATUS_FORMAT,
                     "cannot use colors '%s': its first line does not name the columns L, a, b or X, Y, Z", t->name);
}

static status read_row(struct table *t, char *line, double rgb[COLOR_CHART_PATCHES][3], struct error *err)
{
    double value[3] = {NAN, NAN, NAN};
    size_t i = 0;
    for (char *field; (field = next_field(&line)) != NULL; i++)
        for (size_t k = 0; k < 3; k++) {
            char *end;
            if (t->column[k] != i) continue;
            value[k] = strtod(field, &end);
            if (end == field || *end != '\0') value[k] = NAN;
        }
    for (size_t k = 0; k < 3; k++)
        if (!(value[k] >= (t->is_xyz || k == 0 ? 0.0 : -150.0) && value[k] <= 150.0))
            return error_set(err, STATUS_INVALID,
                             "cannot use colors '%s': line %zu has no color (L and X, Y, Z are 0 to 150)", t->name,
                             t->i_line);
    if (t->n_row == COLOR_CHART_PATCHES)
        return error_set(err, STATUS_INVALID, "cannot use colors '%s': it has more than %d rows", t->name,
                         COLOR_CHART_PATCHES);
    for (size_t k = 0; k < 3 && t->is_xyz; k++) value[k] /= 100.0;
    (t->is_xyz ? rgb_of_xyz : rgb_of_lab)(value, rgb[t->n_row++]);
    return STATUS_OK;
}

status color_chart_reference_read(const char *path, double rgb[COLOR_CHART_PATCHES][3], struct error *err)
{
    struct table t = {.name = path_file_name(path)};
    char *text = NULL;
    size_t n = 0;
    status s = file_read_all(path, MAX_TABLE_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    char *rest = text, *line;
    if (n >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) rest += 3;
    while (s == STATUS_OK && (line = strsep(&rest, "\n")) != NULL) {
        t.i_line++;
        if (line[0] == '#' || line[strspn(line, " \t\r")] == '\0') continue;
        s = t.has_head ? read_row(&t, line, rgb, err) : read_head(&t, line, err);
    }
    if (s == STATUS_OK && t.n_row != COLOR_CHART_PATCHES)
        s = error_set(err, STATUS_INVALID, "cannot use colors '%s': it has %zu rows, a chart has %d patches", t.name,
                      t.n_row, COLOR_CHART_PATCHES);
    free(text);
    return s;
}

const char *color_chart_patch_name(size_t i)
{
    static const char *const name[COLOR_CHART_PATCHES] = {
        "dark skin", "light skin",    "blue sky",     "foliage",   "blue flower",  "bluish green",
        "orange",    "purplish blue", "moderate red", "purple",    "yellow green", "orange yellow",
        "blue",      "green",         "red",          "yellow",    "magenta",      "cyan",
        "white",     "neutral 8",     "neutral 6.5",  "neutral 5", "neutral 3.5",  "black"};
    return name[i];
}
