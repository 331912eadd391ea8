#include "optimizer/tools/phantom/phantom_view_table.h"

#include "base/files/durable.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct angles {
    short light_theta, light_phi, camera_theta, camera_phi;
};

/* Retroreflecting, mirror-like and crossed positions in degrees. Each is used at rotations 0 and 90 of the cloth. */
static const struct angles fit_angles[] = {{20, 0, 20, 180}, {45, 0, 45, 180}, {75, 0, 75, 180}, {60, 0, 0, 180},
                                           {20, 0, 20, 90},  {45, 0, 45, 90},  {64, 0, 64, 90},  {60, 0, 0, 90}};
static const struct angles held_out_angles[] = {{10, 0, 30, 180}, {30, 0, 50, 180}, {50, 0, 70, 180}, {70, 0, 50, 180},
                                                {30, 0, 30, 135}, {60, 0, 60, 135}, {45, 0, 20, 90},  {70, 0, 30, 90},
                                                {40, 0, 40, 45},  {60, 0, 30, 20},  {70, 0, 70, 150}, {0, 0, 60, 0}};

static void name_view(struct job_photograph *v, size_t number)
{
    snprintf(v->file, sizeof v->file, "%s-%02zu.exr", v->set == JOB_SET_FIT ? "fit" : "held-out", number);
    v->scale = 1.0;
}

static void append(struct phantom_view_table *t, enum job_set set, const struct angles *a, size_t n)
{
    for (size_t turn = 0; turn < 2; turn++)
        for (size_t i = 0; i < n; i++) {
            struct job_photograph *v = &t->view[t->n++];
            *v = (struct job_photograph){.set = set,
                                         .light_theta_deg = a[i].light_theta,
                                         .light_phi_deg = a[i].light_phi,
                                         .camera_theta_deg = a[i].camera_theta,
                                         .camera_phi_deg = a[i].camera_phi,
                                         .cloth_rotation_deg = 90.0 * (double)turn};
            name_view(v, turn * n + i);
        }
}

void phantom_view_table_builtin(struct phantom_view_table *t)
{
    t->n = 0;
    append(t, JOB_SET_FIT, fit_angles, sizeof fit_angles / sizeof *fit_angles);
    append(t, JOB_SET_HELD_OUT, held_out_angles, sizeof held_out_angles / sizeof *held_out_angles);
}

enum {
    COLUMN_SET,
    COLUMN_LIGHT_THETA,
    COLUMN_LIGHT_PHI,
    COLUMN_CAMERA_THETA,
    COLUMN_CAMERA_PHI,
    COLUMN_ROTATION,
    N_COLUMN,
    CELLS_MAX = 64
};

static const char *const column_name[N_COLUMN] = {
    "set", "light_theta_deg", "light_phi_deg", "camera_theta_deg", "camera_phi_deg", "cloth_rotation_deg"};

/* Splits a line at its commas, in place. */
static size_t split(char *line, char *cell[CELLS_MAX])
{
    size_t n = 0;
    line[strcspn(line, "\r\n")] = '\0';
    while (n < CELLS_MAX) {
        cell[n++] = line;
        line += strcspn(line, ",");
        if (*line == '\0') break;
        *line++ = '\0';
    }
    return n;
}

static status read_columns(char **cell, size_t n, long place[N_COLUMN], const char *path, struct error *err)
{
    for (int c = 0; c < N_COLUMN; c++) {
        place[c] = -1;
        for (size_t i = 0; i < n; i++)
            if (strcmp(cell[i], column_name[c]) == 0) place[c] = (long)i;
        if (place[c] < 0 && c != COLUMN_ROTATION)
            return error_set(err, STATUS_FORMAT, "cannot read table '%s': column '%s' is missing", path,
                             column_name[c]);
    }
    return STATUS_OK;
}

static status read_row(char **cell, size_t n, const long place[N_COLUMN], struct job_photograph *v, const char *path,
                       size_t i_line, struct error *err)
{
    double *to[N_COLUMN] = {
        NULL, &v->light_theta_deg, &v->light_phi_deg, &v->camera_theta_deg, &v->camera_phi_deg, &v->cloth_rotation_deg};
    *v = (struct job_photograph){0};
    for (int c = 0; c < N_COLUMN; c++) {
        if (place[c] < 0) continue;
        if ((size_t)place[c] >= n)
            return error_set(err, STATUS_FORMAT, "cannot read table '%s': line %zu has no '%s'", path, i_line,
                             column_name[c]);
        const char *text = cell[place[c]];
        if (c == COLUMN_SET) {
            if (strcmp(text, "fit") != 0 && strcmp(text, "held-out") != 0)
                return error_set(err, STATUS_FORMAT,
                                 "cannot read table '%s': line %zu: set '%s' is neither fit nor held-out", path, i_line,
                                 text);
            v->set = strcmp(text, "fit") == 0 ? JOB_SET_FIT : JOB_SET_HELD_OUT;
            continue;
        }
        char *end;
        *to[c] = strtod(text, &end);
        if (end == text || *end != '\0' || !isfinite(*to[c]))
            return error_set(err, STATUS_FORMAT, "cannot read table '%s': line %zu: %s '%s' is no number", path, i_line,
                             column_name[c], text);
    }
    return STATUS_OK;
}

status phantom_view_table_read(struct phantom_view_table *t, const char *path, struct error *err)
{
    char *text = NULL;
    size_t i_line = 0, count[2] = {0, 0};
    long place[N_COLUMN];
    bool named = false;
    t->n = 0;
    status st = file_read_all(path, 1 << 24, &text, NULL, err);
    for (char *line = text, *next; st == STATUS_OK && line != NULL && *line != '\0'; line = next) {
        next = strchr(line, '\n');
        if (next != NULL) *next++ = '\0';
        i_line++;
        if (line[0] == '#' || line[strspn(line, " \r\t")] == '\0') continue;
        char *cell[CELLS_MAX];
        size_t n = split(line, cell);
        if (!named) {
            st = read_columns(cell, n, place, path, err);
            named = true;
            continue;
        }
        if (t->n == JOB_MAX_PHOTOGRAPH) {
            st =
                error_set(err, STATUS_TOO_LARGE, "cannot read table '%s': more than %d rows", path, JOB_MAX_PHOTOGRAPH);
            break;
        }
        struct job_photograph *v = &t->view[t->n++];
        st = read_row(cell, n, place, v, path, i_line, err);
        if (st == STATUS_OK) name_view(v, count[v->set == JOB_SET_HELD_OUT]++);
    }
    if (st == STATUS_OK && t->n == 0)
        st = error_set(err, STATUS_FORMAT, "cannot read table '%s': it has no rows", path);
    free(text);
    return st;
}
