/* Reads parameter files of real yarns: "key: value" lines, lengths in centimetres. The layout is the one read by the
 * generator published with Zhao et al. 2016. Keys that only control the generator (its box and step sizes) are
 * skipped. */
#include "geometry/phantom/phantom.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KIND_IGNORED = 0, KIND_NUMBER = 1, KIND_PAIR = 2 };

struct key {
    const char *name;
    int kind;
    bool required;
    double *to;
    double factor, lower, upper; /* range of the first number, as in the file */
};

static status bad_line(const char *path, size_t line, struct error *err, const char *what, const char *subject)
{
    return error_set_field(err, STATUS_FORMAT, "yarn", "cannot read yarn '%s': line %zu: %s '%.60s'", path, line, what,
                           subject);
}

static status read_value(const struct key *k, const char *text, const char *path, size_t line, struct error *err)
{
    for (int i = 0; i < k->kind; i++) {
        char *end;
        double x = strtod(text, &end);
        if (end == text || !isfinite(x)) return bad_line(path, line, err, "a number is missing after", k->name);
        if (i == 0 && (x < k->lower || x > k->upper)) return bad_line(path, line, err, "out of range:", k->name);
        if (i == 1 && x < 0.0) return bad_line(path, line, err, "a standard deviation is negative:", k->name);
        k->to[i] = x * k->factor;
        text = end;
    }
    return text[strspn(text, " \t\r\n")] == '\0' ? STATUS_OK
                                                 : bad_line(path, line, err, "more than a value after", k->name);
}

static status read_lines(FILE *file, const struct key *key, size_t n_key, bool *seen, const char *path,
                         struct error *err)
{
    char text[512];
    for (size_t line = 1; fgets(text, sizeof text, file) != NULL; line++) {
        if (text[strspn(text, " \t\r\n")] == '\0') continue;
        char *colon = strchr(text, ':');
        if (colon == NULL || line > 200) return bad_line(path, line, err, "not 'key: value':", text);
        *colon = '\0';
        size_t k = 0;
        while (k < n_key && strcmp(key[k].name, text) != 0) k++;
        if (k == n_key) return bad_line(path, line, err, "unknown key", text);
        seen[k] = true;
        status s = key[k].kind == KIND_IGNORED ? STATUS_OK : read_value(&key[k], colon + 1, path, line, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

status phantom_yarn_read(const char *path, struct phantom_yarn_law *yarn, struct error *err)
{
    const double cm = 1e-2, per_cm = 1e2;
    double n_ply = 0.0, n_fiber = 0.0, clockwise[2] = {0.0, 0.0}, use_migration = 0.0, use_flyaway = 0.0;
    struct phantom_yarn_law y = {.rho_min = 1.0, .rho_max = 1.0};
    const struct key key[] = {
        {"ply_num", KIND_NUMBER, true, &n_ply, 1, 1, 12},
        {"fiber_num", KIND_NUMBER, true, &n_fiber, 1, 1, 2000},
        {"yarn_clock_wise", KIND_NUMBER, true, &clockwise[0], 1, 0, 1},
        {"fiber_clock_wise", KIND_NUMBER, true, &clockwise[1], 1, 0, 1},
        {"yarn_alpha", KIND_NUMBER, true, &y.ply_pitch_m, cm, 1e-4, 1e3},
        {"alpha", KIND_NUMBER, true, &y.fiber_pitch_m, cm, 1e-4, 1e3},
        {"yarn_radius", KIND_NUMBER, true, &y.ply_distance_m, cm, 0, 10},
        {"ellipse_long", KIND_NUMBER, true, &y.ellipse_m[0], cm, 1e-6, 10},
        {"ellipse_short", KIND_NUMBER, true, &y.ellipse_m[1], cm, 1e-6, 10},
        {"epsilon", KIND_NUMBER, true, &y.epsilon, 1, 0, 0.5},
        {"beta", KIND_NUMBER, true, &y.beta, 1, 0, 20},
        {"R_max", KIND_NUMBER, true, &y.r_max, 1, 0.01, 1},
        {"use_migration", KIND_NUMBER, false, &use_migration, 1, 0, 1},
        {"s_i", KIND_NUMBER, false, &y.migration_waves, 1, 0, 100},
        {"rho_min", KIND_NUMBER, false, &y.rho_min, 1, 0, 1},
        {"rho_max", KIND_NUMBER, false, &y.rho_max, 1, 0, 2},
        {"use_flyaways", KIND_NUMBER, false, &use_flyaway, 1, 0, 1},
        {"flyaway_hair_density", KIND_NUMBER, false, &y.hair_per_m, per_cm, 0, 1e4},
        {"flyaway_hair_ze", KIND_PAIR, false, y.hair_length_m, cm, -10, 10},
        {"flyaway_hair_r0", KIND_PAIR, false, y.hair_start_m, cm, 0, 10},
        {"flyaway_hair_re", KIND_PAIR, false, y.hair_reach_m, cm, 0, 10},
        {"flyaway_hair_pe", KIND_PAIR, false, y.hair_turn_rad, 1, -100, 100},
        {"flyaway_loop_density", KIND_NUMBER, false, &y.loop_per_m, per_cm, 0, 1e4},
        {"flyaway_loop_r1", KIND_PAIR, false, y.loop_radius_m, cm, 0, 10},
        {"aabb_min", KIND_IGNORED, false, NULL, 0, 0, 0},
        {"aabb_max", KIND_IGNORED, false, NULL, 0, 0, 0},
        {"z_step_size", KIND_IGNORED, false, NULL, 0, 0, 0},
        {"z_step_num", KIND_IGNORED, false, NULL, 0, 0, 0},
        {"fly_step_size", KIND_IGNORED, false, NULL, 0, 0, 0},
    };
    enum { N_KEY = sizeof key / sizeof *key };
    bool seen[N_KEY] = {false};
    FILE *file = fopen(path, "re");
    if (file == NULL) return error_set_errno_at(err, __func__, "yarn", "cannot read yarn '%s'", path);
    status s = read_lines(file, key, N_KEY, seen, path, err);
    fclose(file);
    for (size_t k = 0; k < N_KEY && s == STATUS_OK; k++)
        if (key[k].required && !seen[k])
            s = error_set_field(err, STATUS_FORMAT, "yarn", "cannot read yarn '%s': '%s' is missing", path,
                                key[k].name);
    if (s != STATUS_OK) return s;
    y.n_ply = (size_t)n_ply;
    y.n_fiber = (size_t)n_fiber;
    if (clockwise[0] != 0.0) y.ply_pitch_m = -y.ply_pitch_m;
    if (clockwise[1] != 0.0) y.fiber_pitch_m = -y.fiber_pitch_m;
    if (use_migration == 0.0) y.rho_min = y.rho_max = 1.0;
    if (use_flyaway == 0.0) y.hair_per_m = y.loop_per_m = 0.0;
    *yarn = y;
    return STATUS_OK;
}
