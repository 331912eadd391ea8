/* What the kind of a picture decides: the views of the studio, and the keys that each kind takes
 * (job_picture_complete). */
#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/job_results.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MEASUREMENT_PX = 512, STUDIO_PX = 1024, STUDIO_DEEP_PATHS = 4000000 };

/* A view of the studio, whose lights follow from its kind (renderer/preview/studio_light.h). */
static const struct studio_view {
    const char *name;
    enum job_surface on;
    double size_mm, radius_mm, width_mm, camera_theta_deg, camera_phi_deg, rotation_deg;
} view_of[] = {
    [JOB_KIND_MEASUREMENT] = {.name = "measurement"},
    [JOB_KIND_SWATCH] = {"swatch", JOB_ON_FLAT, 40.0, 15.0, 52.0, 25.0, 270.0, 6.0},
    [JOB_KIND_ROLL] = {"roll", JOB_ON_ROLL, 40.0, 8.0, 50.0, 60.0, 245.0, 0.0},
    [JOB_KIND_DRAPE] = {"drape", JOB_ON_DRAPE, 60.0, 15.0, 58.0, 56.0, 250.0, 20.0},
    [JOB_KIND_FOLD] = {"fold", JOB_ON_FOLD, 40.0, 15.0, 56.0, 78.0, 262.0, 0.0},
    [JOB_KIND_CLOSE_UP] = {"close_up", JOB_ON_FLAT, 20.0, 15.0, 2.0, 30.0, 270.0, 12.0},
    [JOB_KIND_FAR] = {"far", JOB_ON_DRAPE, 300.0, 75.0, 270.0, 60.0, 250.0, 20.0},
    [JOB_KIND_LIT_THROUGH] = {"lit_through", JOB_ON_FLAT, 40.0, 15.0, 8.0, 0.0, 270.0, 0.0},
};

const char *job_picture_kind_name(enum job_picture_kind kind) { return view_of[kind].name; }

static bool is_given(const json_t *given, const char *key) { return json_object_get(given, key) != NULL; }

/* The keys without which a measurement has no view. */
static status check_measurement(const json_t *given, size_t i, struct error *err)
{
    static const struct {
        const char *key;
        double upper;
    } angle[] = {
        {"light_theta_deg", 180.0}, {"light_phi_deg", 360.0}, {"camera_theta_deg", 89.999}, {"camera_phi_deg", 360.0}};
    char field[64];
    snprintf(field, sizeof field, "pictures[%zu]", i);
    if (!is_given(given, "on")) return error_set_field(err, STATUS_INVALID, field, "'%s' lacks 'on'", field);
    for (size_t k = 0; k < sizeof angle / sizeof *angle; k++) {
        if (is_given(given, angle[k].key)) continue;
        snprintf(field, sizeof field, "pictures[%zu].%s", i, angle[k].key);
        return error_set_field(err, STATUS_INVALID, field, "'%s' is missing: give a number from %g to %g", field,
                               k % 2 == 0 ? 0.0 : -angle[k].upper, angle[k].upper);
    }
    return STATUS_OK;
}

static status check_studio(const json_t *given, size_t i, const char *kind, struct error *err)
{
    static const char *const taken[] = {
        "kind", "px", "samples", "method", "deep_light_paths", "cloth_rotation_deg", "reference", NULL};
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)given, key, value)
    {
        size_t k = 0;
        char field[96];
        while (taken[k] != NULL && strcmp(taken[k], key) != 0) k++;
        if (taken[k] != NULL) continue;
        snprintf(field, sizeof field, "pictures[%zu].%s", i, key);
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' is given, but 'kind' is \"%s\", whose lamp, camera and surface are those of the "
                               "studio: leave it out, or take the kind \"measurement\"",
                               field, kind);
    }
    return STATUS_OK;
}

static void take_view(const struct studio_view *view, struct job_surface_picture *p)
{
    p->on = view->on;
    p->size_mm = view->size_mm;
    p->radius_mm = view->radius_mm;
    p->width_mm = view->width_mm;
    p->camera_theta_deg = view->camera_theta_deg;
    p->camera_phi_deg = view->camera_phi_deg;
    p->light_theta_deg = p->light_phi_deg = 0.0; /* not used */
    p->black_sheet = 0;
}

void job_picture_studio(enum job_picture_kind kind, struct job_surface_picture *p)
{
    *p = (struct job_surface_picture){.kind = kind,
                                      .wrap_deg = 180.0,
                                      .lamp_sharpness = NAN,
                                      .focus_mm = NAN,
                                      .ground_gap_mm = NAN,
                                      .ground_albedo = 0.5,
                                      .px = STUDIO_PX,
                                      .sample = 16,
                                      .method = JOB_PICTURE_FAST,
                                      .n_deep_path = STUDIO_DEEP_PATHS,
                                      .filter = true,
                                      .cloth_rotation_deg = view_of[kind].rotation_deg};
    take_view(&view_of[kind], p);
}

status job_picture_complete(const json_t *given, size_t i, struct job_surface_picture *p, struct error *err)
{
    const struct studio_view *view = &view_of[p->kind];
    const bool studio = p->kind != JOB_KIND_MEASUREMENT;
    if (p->px == 0) p->px = studio ? STUDIO_PX : MEASUREMENT_PX;
    if (!studio) return check_measurement(given, i, err);
    status s = check_studio(given, i, view->name, err);
    if (s != STATUS_OK) return s;
    take_view(view, p);
    p->filter = true;
    if (!is_given(given, "method")) p->method = JOB_PICTURE_FAST;
    if (!is_given(given, "deep_light_paths")) p->n_deep_path = STUDIO_DEEP_PATHS;
    if (!is_given(given, "cloth_rotation_deg")) p->cloth_rotation_deg = view->rotation_deg;
    return STATUS_OK;
}
