#include "optimizer/photographs/camera/rig.h"

#include "base/files/durable.h"
#include "base/files/json_text.h"
#include "base/option_id.h"
#include "optimizer/job/checks/job_consistency.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/json_field.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_BYTES = 1 << 20, VERSION = 1 };

/* A lamp or a camera. */
struct station {
    double theta_deg, phi_deg, distance_cm;
};

static status read_station(const struct json_field *stations, const char *name, double theta_upper, struct station *out,
                           struct error *err)
{
    static const char *const key[] = {"theta_deg", "phi_deg", "distance_cm", "position_mm", NULL};
    struct json_field f;
    bool present;
    double position_mm[3];
    *out = (struct station){.distance_cm = NAN};
    status s = json_field_object(stations, name, &f, &present, err);
    if (s == STATUS_OK && !present) s = error_set(err, STATUS_INVALID, "'%s' has no '%s'", stations->path, name);
    if (s == STATUS_OK) s = json_field_check_keys(&f, key, err);
    if (s != STATUS_OK) return s;
    if (json_object_get(f.object, "position_mm") == NULL) {
        s = json_field_required_number(&f, "theta_deg", 0.0, theta_upper, &out->theta_deg, err);
        if (s == STATUS_OK) s = json_field_required_number(&f, "phi_deg", -360.0, 360.0, &out->phi_deg, err);
        return s == STATUS_OK ? json_field_number(&f, "distance_cm", 1.0, 100000.0, &out->distance_cm, err) : s;
    }
    if (json_object_size(f.object) > 1)
        return error_set(err, STATUS_INVALID, "'%s' has 'position_mm' and angles or a distance: give one of them",
                         f.path);
    s = json_field_number_array(&f, "position_mm", 3, -1e6, 1e6, position_mm, err);
    if (s != STATUS_OK) return s;
    job_angles_of_position(position_mm, &out->theta_deg, &out->phi_deg, &out->distance_cm);
    if (!(out->distance_cm >= 1.0) || out->theta_deg > theta_upper)
        return error_set(err, STATUS_INVALID, "'%s.position_mm' is %s", f.path,
                         out->distance_cm >= 1.0 ? "below the cloth" : "nearer than 10 mm to the orbit center");
    return STATUS_OK;
}

/* Exactly n numbers, which must be given. */
static status required_numbers(const struct json_field *f, const char *key, size_t n, double limit, double *out,
                               struct error *err)
{
    if (json_object_get(f->object, key) == NULL)
        return error_set(err, STATUS_INVALID, "'%s.%s' is missing: give %zu numbers", f->path, key, n);
    return json_field_number_array(f, key, n, -limit, limit, out, err);
}

static status text_of(const struct json_field *f, const char *key, char out[64], struct error *err)
{
    return json_field_text(f, key, true, out, 64, err);
}

/* Gives photograph i the view that it names. */
static status apply_view(const struct json_field *rig, struct job_setup *setup, struct job_rows *rows, size_t i,
                         struct error *err)
{
    static const char *const key[] = {"lamp", "camera", "cloth_rotation_deg", NULL};
    struct job_photograph *p = &rows->photograph[i];
    struct json_field views, f, lamps, cameras;
    struct station lamp, camera = {NAN, NAN, NAN}; /* by markers: not known yet */
    char lamp_name[64], camera_name[64], field[64];
    bool present;
    status s = json_field_object(rig, "views", &views, &present, err);
    if (s == STATUS_OK) s = json_field_object(&views, p->view, &f, &present, err);
    if (s == STATUS_OK && !present) {
        snprintf(field, sizeof field, OPTION_PHOTOGRAPH_VIEW "[%zu]", i);
        return error_set_field(err, STATUS_INVALID, field, "photograph '%s' names the view '%s', which the rig has not",
                               p->file, p->view);
    }
    if (s == STATUS_OK) s = json_field_check_keys(&f, key, err);
    if (s == STATUS_OK) s = text_of(&f, "lamp", lamp_name, err);
    bool by_markers = json_object_get(f.object, "camera") == NULL && json_object_get(rig->object, "markers") != NULL;
    if (s == STATUS_OK && !by_markers) s = text_of(&f, "camera", camera_name, err);
    if (s == STATUS_OK) s = json_field_number(&f, "cloth_rotation_deg", -360.0, 360.0, &p->cloth_rotation_deg, err);
    if (s == STATUS_OK) s = json_field_object(rig, "lamps", &lamps, &present, err);
    if (s == STATUS_OK) s = read_station(&lamps, lamp_name, 180.0, &lamp, err);
    if (s == STATUS_OK) s = json_field_object(rig, "cameras", &cameras, &present, err);
    if (s == STATUS_OK && !by_markers) s = read_station(&cameras, camera_name, 89.999, &camera, err);
    if (s != STATUS_OK) return s;
    if (lamp.theta_deg >= 90.0 && !job_photograph_is_cylinder(p) && (setup->black_sheet || lamp.theta_deg == 90.0))
        return error_set(
            err, STATUS_INVALID,
            "'lamps.%s' is at %g degrees from the normal: allowed are 0 to below 90 (above 90, from behind, "
            "without black_sheet)",
            lamp_name, lamp.theta_deg);
    p->light_theta_deg = lamp.theta_deg;
    p->light_phi_deg = lamp.phi_deg;
    p->light_distance_cm = lamp.distance_cm;
    p->camera_theta_deg = camera.theta_deg;
    p->camera_phi_deg = camera.phi_deg;
    p->camera_distance_cm = camera.distance_cm;
    return STATUS_OK;
}

static status read_vignetting(const struct json_field *lens, struct lens *l, struct error *err)
{
    static const char *const key[] = {"center_px", "radius_px", "a", NULL};
    struct json_field f;
    status s = json_field_object(lens, "vignetting", &f, &l->has_vignetting, err);
    if (s != STATUS_OK || !l->has_vignetting) return s;
    s = json_field_check_keys(&f, key, err);
    if (s == STATUS_OK) s = required_numbers(&f, "center_px", 2, 1e6, l->vignetting_center_px, err);
    if (s == STATUS_OK) s = json_field_required_number(&f, "radius_px", 1.0, 1e6, &l->vignetting_radius_px, err);
    return s == STATUS_OK ? required_numbers(&f, "a", 3, 10.0, l->vignetting, err) : s;
}

static status read_distortion(const struct json_field *lens, struct lens *l, struct error *err)
{
    static const char *const key[] = {"focal_px", "center_px", "k", "p", NULL};
    struct json_field f;
    status s = json_field_object(lens, "distortion", &f, &l->has_distortion, err);
    if (s != STATUS_OK || !l->has_distortion) return s;
    s = json_field_check_keys(&f, key, err);
    if (s == STATUS_OK) s = required_numbers(&f, "focal_px", 2, 1e7, l->focal_px, err);
    if (s == STATUS_OK) s = required_numbers(&f, "center_px", 2, 1e6, l->center_px, err);
    if (s == STATUS_OK) s = required_numbers(&f, "k", 3, 1e4, l->k, err);
    if (s == STATUS_OK) s = required_numbers(&f, "p", 2, 10.0, l->p, err);
    if (s == STATUS_OK && !(l->focal_px[0] >= 1.0 && l->focal_px[1] >= 1.0))
        s = error_set(err, STATUS_INVALID, "'%s.focal_px' must be at least 1", f.path);
    return s;
}

static status read_centers(const struct json_field *markers, struct marker_board *b, struct error *err)
{
    struct json_field centers;
    bool present;
    status s = json_field_object(markers, "center_mm", &centers, &present, err);
    size_t n = s == STATUS_OK ? json_object_size(centers.object) : 0;
    if (s == STATUS_OK && (n < 2 || n > MARKER_MAX))
        s = error_set(err, STATUS_INVALID, "'markers.center_mm' must name 2 to %d markers", MARKER_MAX);
    void *iter = json_object_iter((json_t *)(uintptr_t)centers.object);
    for (; s == STATUS_OK && iter != NULL; iter = json_object_iter_next((json_t *)(uintptr_t)centers.object, iter)) {
        const char *name = json_object_iter_key(iter);
        char *end;
        long id = strtol(name, &end, 10);
        if (end == name || *end != '\0' || id < 0 || id > 1023)
            return error_set(err, STATUS_INVALID, "'markers.center_mm.%.40s': the key must be the number of a marker",
                             name);
        b->id[b->n] = (int)id;
        s = required_numbers(&centers, name, 2, 1e5, b->center_mm[b->n++], err);
    }
    return s;
}

static status read_charuco(const struct json_field *f, struct marker_board *b, struct error *err)
{
    static const char *const key[] = {"squares", "square_mm", "upper_left_mm", "first_square", NULL};
    double squares[2], upper_left_mm[2];
    char first[64] = "black";
    status s = json_field_check_keys(f, key, err);
    if (s == STATUS_OK) s = required_numbers(f, "squares", 2, 1000.0, squares, err);
    if (s == STATUS_OK) s = required_numbers(f, "upper_left_mm", 2, 1e5, upper_left_mm, err);
    if (s == STATUS_OK) s = json_field_required_number(f, "square_mm", 0.1, 10000.0, &b->square_mm, err);
    if (s == STATUS_OK) s = json_field_text(f, "first_square", false, first, sizeof first, err);
    if (s != STATUS_OK) return s;
    if (strcmp(first, "black") != 0 && strcmp(first, "white") != 0)
        return error_set(err, STATUS_INVALID, "'%s.first_square' must be \"black\" or \"white\"", f->path);
    if (!(b->side_mm < b->square_mm))
        return error_set(err, STATUS_INVALID, "'%s.square_mm' must be larger than the markers in the squares (%g mm)",
                         f->path, b->side_mm);
    size_t n[2];
    for (size_t i = 0; i < 2; i++) n[i] = squares[i] >= 3.0 && squares[i] == rint(squares[i]) ? (size_t)squares[i] : 0;
    if (!marker_board_fill(b, n, upper_left_mm, strcmp(first, "black") == 0))
        return error_set(err, STATUS_INVALID,
                         "'%s.squares' must be two whole numbers from 3 on, with at most %d inner corners", f->path,
                         MARKER_MAX_CORNER);
    return STATUS_OK;
}

static status read_board(const struct json_field *rig, struct marker_board *b, struct error *err)
{
    static const char *const key[] = {"dictionary", "side_mm", "center_mm", "charuco", NULL};
    struct json_field f, charuco;
    bool present, is_charuco = false;
    status s = json_field_object(rig, "markers", &f, &present, err);
    if (s != STATUS_OK || !present) return s;
    s = json_field_check_keys(&f, key, err);
    if (s == STATUS_OK) s = json_field_text(&f, "dictionary", true, b->dictionary, sizeof b->dictionary, err);
    if (s == STATUS_OK) s = json_field_required_number(&f, "side_mm", 0.1, 10000.0, &b->side_mm, err);
    if (s == STATUS_OK) s = json_field_object(&f, "charuco", &charuco, &is_charuco, err);
    if (s == STATUS_OK && is_charuco && json_object_get(f.object, "center_mm") != NULL)
        s = error_set(err, STATUS_INVALID, "'markers' has both 'center_mm' and 'charuco': give one of them");
    if (s != STATUS_OK) return s;
    return is_charuco ? read_charuco(&charuco, b, err) : read_centers(&f, b, err);
}

/* Lamps and cameras of the rig together, as far as it gives them by angles. */
static status check_radians(const struct json_field *rig, struct error *err)
{
    static const char *const list[] = {"lamps", "cameras"};
    struct angle_span span = {0};
    for (size_t k = 0; k < sizeof list / sizeof list[0]; k++) {
        const char *name;
        json_t *station;
        json_object_foreach(json_object_get(rig->object, list[k]), name, station)
        {
            const double theta = json_number_value(json_object_get(station, "theta_deg")),
                         phi = json_number_value(json_object_get(station, "phi_deg"));
            if (json_object_get(station, "theta_deg") != NULL) angle_span_add(&span, theta, phi, theta, phi, 0.0);
        }
    }
    if (!angle_span_in_radians(&span)) return STATUS_OK;
    return error_set(err, STATUS_INVALID,
                     "the angles of 'lamps' and 'cameras' look like radians: the largest one from the normal is %.3g; "
                     "write degrees",
                     span.theta);
}

static status apply(const json_t *json, struct job_setup *setup, struct job_rows *rows, struct lens *lens,
                    struct marker_board *board, struct error *err)
{
    static const char *const key[] = {"selvedge_rig", "lamps", "cameras", "views", "lens", "markers", NULL};
    static const char *const lens_key[] = {"vignetting", "distortion", NULL};
    struct json_field rig = {.object = json}, f;
    size_t version = 0;
    bool present = false;
    status s = json_field_check_keys(&rig, key, err);
    if (s == STATUS_OK) s = json_field_size(&rig, "selvedge_rig", VERSION, VERSION, &version, err);
    if (s == STATUS_OK && version != VERSION)
        s = error_set(err, STATUS_INVALID, "'selvedge_rig' is missing: it must be %d", VERSION);
    if (s == STATUS_OK) s = json_field_object(&rig, "lens", &f, &present, err);
    if (s == STATUS_OK && present) s = json_field_check_keys(&f, lens_key, err);
    if (s == STATUS_OK && present) s = read_vignetting(&f, lens, err);
    if (s == STATUS_OK && present) s = read_distortion(&f, lens, err);
    if (s == STATUS_OK) s = read_board(&rig, board, err);
    if (s == STATUS_OK) s = check_radians(&rig, err);
    for (size_t i = 0; i < rows->n_photograph && s == STATUS_OK; i++)
        if (rows->photograph[i].view[0] != '\0') s = apply_view(&rig, setup, rows, i, err);
    return s;
}

status rig_apply(const char *path, struct job_setup *setup, struct job_rows *rows, struct lens *lens,
                 struct marker_board *board, struct error *err)
{
    char *text = NULL;
    size_t n = 0;
    struct error fault = {0};
    const char *name = path_file_name(path);
    *lens = (struct lens){0};
    *board = (struct marker_board){0};
    status s = file_read_all(path, MAX_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    json_t *json = json_text_parse(text, n, "its text", &fault);
    free(text);
    if (json == NULL)
        return error_set_field(err, STATUS_FORMAT, OPTION_RIG, "cannot use rig '%s': %s", name, fault.text);
    s = apply(json, setup, rows, lens, board, err);
    json_decref(json);
    if (s == STATUS_OK) return STATUS_OK;
    if (err != NULL && strncmp(err->field, OPTION_PHOTOGRAPH_VIEW, strlen(OPTION_PHOTOGRAPH_VIEW)) != 0)
        snprintf(err->field, sizeof err->field, OPTION_RIG);
    return error_prefix(err, s, "cannot use rig '%s'", name);
}
