/* Outlines from files (wave_outline.h). */
#include "renderer/scattering/models/wave/solver/wave_outline.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_POINTS = 20000 };

struct points {
    size_t n;
    double xy[MOST_POINTS][2];
};

static status read_line(struct points *p, const char *line, int i_line, const char *path, struct error *err)
{
    const char *at = line + strspn(line, " \t");
    double v[2];
    if (strchr("#\r\n", *at) != NULL) return STATUS_OK; /* the end of a line without an end, too */
    for (int k = 0; k < 2; k++) {
        char *end;
        v[k] = strtod(at, &end);
        const char *after = end + strspn(end, " \t");
        if (end == at || (k == 0 ? *after != ',' : strchr("\r\n", *after) == NULL))
            return error_set_field(err, STATUS_INVALID, "points", "line %d of outline '%s' is not \"x,y\"", i_line,
                                   path);
        at = after + 1;
    }
    if (p->n == MOST_POINTS)
        return error_set_field(err, STATUS_INVALID, "points", "outline '%s' has more than %d points", path,
                               MOST_POINTS);
    memcpy(p->xy[p->n++], v, sizeof v);
    return STATUS_OK;
}

status wave_outline_load(struct wave_outline *o, const char *path, int n_wave, struct error *err)
{
    char line[256];
    status st = STATUS_OK;
    FILE *f = fopen(path, "r");
    if (f == NULL) return error_set_errno(err, "cannot open outline '%s'", path);
    struct points *p = calloc(1, sizeof *p);
    if (p == NULL) st = error_set(err, STATUS_NO_MEMORY, "cannot hold outline '%s': out of memory", path);
    for (int i = 1; st == STATUS_OK && fgets(line, sizeof line, f) != NULL; i++) st = read_line(p, line, i, path, err);
    if (st == STATUS_OK && ferror(f)) st = error_set_errno(err, "cannot read outline '%s'", path);
    fclose(f);
    if (st == STATUS_OK) st = wave_outline_from_points(o, p->xy[0], p->n, n_wave, err);
    free(p);
    return st;
}
