/* Shared by the scenes of all exports: the tile of fibers and its repeats, lamp, camera and materials of the best
 * model. Millimetres; z = 0 is the highest point of the cloth; radiances have the unit of configuration.h.
 *
 * A format is a source that defines export_<name> and has a row EXPORT(name, meaning), where `meaning` describes the
 * option `export.<name>` to people. The Makefile gathers the rows. */
#ifndef SELVEDGE_OPTIMIZER_EXPORT_SCENE_H
#define SELVEDGE_OPTIMIZER_EXPORT_SCENE_H

#include "base/catalogue/film_material.h"
#include "optimizer/report/export/hair_fit.h"
#include "optimizer/report/findings/report.h"

#include <jansson.h>
#include <stdio.h>

enum { EXPORT_MAX_REPEAT = 200 }; /* of the tile, along one axis */

/* How far the cloth with the materials of an export is from the fitted cloth: root mean squares of differences of
 * radiance over the mean of the fitted cloth's channels, or over 0.02 where that is darker
 * (optimizer/fit/objective/objective.h). */
struct hair_error {
    bool stated;                        /* false: there is no error (of hair: hair_on_cloth.h) */
    double rel_rms;                     /* over lamps and cameras of the hemisphere that were not fitted */
    double row_rel_rms, row_rel_rms_se; /* the latter 0: not known */
    double *row_rel_error;              /* of each row of the job; owned */
};

struct export_scene {
    struct report *report;
    const struct pipeline_model *model;
    struct hair_fit hair[SCATTERING_MAX_SET];
    struct hair_error hair_error;
    struct hair_error own_error; /* of a format that judges its material itself, set by its write */
    struct film_groups films;    /* of the cloth, which are left out of exported fibers */
    double z_low_m, z_high_m;
    const char *folder; /* of the format that is being written, under results/ */
    const struct progress *progress;
};

struct export_format {
    bool has_hair; /* hair materials are written (hair_on_cloth.h) */
    /* Relative RMS difference of the program's renderings of these materials from the materials' definition, as
     * measured (docs/exports.md). The stated errors contain it. 0: none is known. */
    double deviation;
    /* *json: an array with one object for each group of fibers, a new reference. */
    status (*write)(struct export_scene *e, json_t **materials, struct error *err);
    /* Paths of a photograph that take as long, after a fit of n_fit_path; NULL: it renders nothing. */
    double (*paths)(const struct job_results *results, size_t n_row, double n_fit_path);
};

#define EXPORT(name, meaning) /* a row stands for nothing in the source of its export */

/* A text of the folder while it is made. */
struct export_text {
    FILE *file;
    char *data;
    size_t n_byte;
};

status export_text_open(struct export_text *t, struct error *err);
/* Closes the text, writes it as the file `name` of the folder and frees it. */
status export_text_close(const struct export_scene *e, struct export_text *t, const char *name, struct error *err);
void export_path(const struct export_scene *e, const char *name, char path[WORKER_PATH_BYTES]);

/* Returns whether fiber i belongs to group. Films belong to none: other programs have no such curves. */
bool export_fiber_in(const struct export_scene *e, size_t i, size_t group);
/* Control points of the cubic B-spline of fiber i: the vertices, and before the first and after the last one its
 * neighbour mirrored there, so that the curve begins and ends at them. Between, it passes a vertex by a sixth of the
 * second difference. */
size_t export_n_point(const struct export_scene *e, size_t i);
void export_point(const struct export_scene *e, size_t i, size_t k, double p_mm[3]);
/* Mean radius of fiber i, and its radius at point k. */
double export_radius_mm(const struct export_scene *e, size_t i);
double export_point_radius_mm(const struct export_scene *e, size_t i, size_t k);
/* "fibers-<group><ending>" */
void export_fibers_name(size_t group, const char *ending, char name[32]);
/* Writes the file with the name above, with each fiber of the group as `print` does. */
status export_fibers_write(const struct export_scene *e, size_t group, const char *ending,
                           void (*print)(FILE *text, const struct export_scene *e, size_t i), struct error *err);

struct export_view {
    double lamp_mm[3], camera_mm[3], up[3];
    double width_mm;   /* of the square that the camera sees, at the origin */
    double fov_deg;    /* of a perspective camera */
    double near_mm;    /* leaves out the lamp where it stands before the camera */
    double radiance;   /* of a square lamp */
    double irradiance; /* of parallel light */
};

/* Lamp and camera are turned instead of the cloth. */
struct export_view export_view_of(const struct export_scene *e, const struct configuration *k);
/* Corners of a square lamp: a, a + u, a + v with u x v towards the origin. */
void export_lamp_corners(const struct export_view *v, double side_mm, double corner[4][3]);
void export_cross(const double a[3], const double b[3], double out[3]);
void export_make_unit(double v[3]);

/* Repeats of the tile along x and y, and where repeat (i, j) stands. False: they do not cover the area that all rows
 * see. */
bool export_repeats(const struct export_scene *e, int n[2]);
void export_repeat_at(const struct export_scene *e, const int n[2], int i, int j, double at_mm[2]);
/* Half widths and height of the black sheet; false: the job has none. */
bool export_sheet(const struct export_scene *e, double half_mm[2], double *z_mm);

/* Whether the plug-ins of the export for Mitsuba evaluate the fitted model itself. */
bool export_mitsuba_is_exact(const struct export_scene *e);

/* rows.csv: lamp and camera of every row with its measured and rendered radiance. */
status export_rows_write(const struct export_scene *e, struct error *err);

/* Adds the name of the group to the entry of its material in result.json. */
json_t *export_material_json(const struct export_scene *e, size_t group, json_t *material);
/* Parameters of the hair materials of all groups. */
json_t *export_hair_json(const struct export_scene *e);

#endif
