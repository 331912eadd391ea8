/* Checks of a job that fits the profile of a single fiber. */
#include "base/catalogue/model_catalogue.h"
#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_profile.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static bool listed(const char *const *list, const char *key)
{
    for (; *list != NULL; list++)
        if (strcmp(*list, key) == 0) return true;
    return false;
}

/* Refuses keys of a section that a profile has no use for. */
static status check_keys(const json_t *section, const char *before, const char *const *allowed, struct error *err)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)section, key, value)
    {
        char path[128];
        snprintf(path, sizeof path, "%s%.100s", before, key);
        if (!listed(allowed, key))
            return error_set_field(err, STATUS_INVALID, path,
                                   "'%s' and 'profile' are both given: a job with the profile of a fiber has no cloth",
                                   path);
    }
    return STATUS_OK;
}

/* Each model of the job can have the mode that the profile shows alone. */
static status check_mode(const struct job_sections *section, struct error *err)
{
    const char *mode = job_profile_mode(section->profile);
    for (size_t i = 0; i < section->fit->n_model && mode != NULL; i++) {
        const char *id = section->fit->model[i].id;
        if (!model_catalogue_has_modes(id))
            return error_set_field(err, STATUS_INVALID, "profile.mode",
                                   "'profile.mode' is '%s', but model '%s' has all modes together: '%s' has them apart",
                                   mode, id, model_catalogue_with_modes(0));
    }
    return STATUS_OK;
}

/* A stated turn of the section counts in at least one model of the job. */
static status check_turn(const struct job_sections *section, struct error *err)
{
    if (isnan(section->profile->turn_deg)) return STATUS_OK;
    for (size_t i = 0; i < section->fit->n_model; i++)
        if (model_catalogue_has_flat_section(section->fit->model[i].id)) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "profile.turn_deg",
                           "'profile.turn_deg' is %g, but the light of '%s' does not change with the turn of the "
                           "section: leave it out, or take '%s'",
                           section->profile->turn_deg, section->fit->model[0].id, model_catalogue_with_flat_section(0));
}

status job_check_profile_document(const struct option_value *v, struct error *err)
{
    static const char *const of_document[] = {"sample", "profile", "fit", NULL},
                             *const of_bowl[] = {"sample", "profile", "fit", "camera", "rig", NULL},
                             *const of_camera[] = {"noise_file", "dark_frames", NULL},
                             *const of_fit[] = {"model",  "models", "seed",   "fixed",          "start", "tied",
                                                "bounds", "priors", "starts", "max_iterations", NULL};
    status s = check_keys(v->value, "", v->section->profile->bowl.given ? of_bowl : of_document, err);
    const json_t *fit = json_object_get(v->value, "fit"), *camera = json_object_get(v->value, "camera");
    if (s == STATUS_OK && camera != NULL) s = check_keys(camera, "camera.", of_camera, err);
    if (s == STATUS_OK && fit != NULL) s = check_keys(fit, "fit.", of_fit, err);
    for (size_t i = 0; i < v->section->fit->n_model && s == STATUS_OK; i++)
        if (model_catalogue_find(v->section->fit->model[i].id)->kind != MODEL_SURFACE)
            s = error_set_field(err, STATUS_INVALID, "fit.models",
                                "'%s' is a model of a cloth as a volume: a profile needs a model of fibers",
                                v->section->fit->model[i].id);
    if (s == STATUS_OK) s = check_mode(v->section, err);
    return s == STATUS_OK ? check_turn(v->section, err) : s;
}

status job_check_profile(const struct option_value *v, struct error *err)
{
    const struct job_profile *profile = v->section->profile;
    const bool file = profile->file[0] != '\0';
    if (file == profile->bowl.given)
        return error_set_field(err, STATUS_INVALID, file ? "profile" : "profile.file",
                               file ? "'profile.file' and 'profile.bowl' are both given: one of them counts"
                                    : "'profile' needs 'file', a table, or 'bowl', photographs");
    if (profile->bowl.given && !isnan(profile->theta_i_deg))
        return error_set_field(err, STATUS_INVALID, "profile.theta_i_deg",
                               "'profile.theta_i_deg' is given, but each photograph of the bowl has its own");
    return STATUS_OK;
}

static status bowl_fault(struct error *err, const char *key, const char *text)
{
    char field[96];
    snprintf(field, sizeof field, "profile.bowl.%s", key);
    return error_set_field(err, STATUS_INVALID, field, "'%s' cannot be: %s", field, text);
}

/* The lamp shines over the rim: where its direction from the fiber meets the sphere, that is not below the rim. */
static status check_lamp(const struct job_bowl *b, size_t i, struct error *err)
{
    const double theta = b->photograph[i].theta_i_deg * M_PI / 180.0, phi = b->photograph[i].phi_i_deg * M_PI / 180.0,
                 lamp[3] = {sin(theta), cos(theta) * cos(phi), -cos(theta) * sin(phi)};
    double along = 0.0, beyond = -b->radius_mm * b->radius_mm;
    char key[64];
    for (size_t k = 0; k < 3; k++) {
        along += lamp[k] * b->fiber_mm[k];
        beyond += b->fiber_mm[k] * b->fiber_mm[k];
    }
    const double z_mm = b->fiber_mm[2] + lamp[2] * (sqrt(along * along - beyond) - along);
    if (z_mm >= b->height_mm - b->radius_mm - 1e-6 * b->radius_mm) return STATUS_OK;
    snprintf(key, sizeof key, "photographs[%zu].phi_i_deg", i);
    return bowl_fault(err, key, "the lamp is below the rim of the bowl, which keeps its light from the fiber");
}

status job_check_bowl(const struct option_value *v, struct error *err)
{
    struct job_profile *profile = v->own;
    struct job_bowl *b = &profile->bowl;
    char text[160];
    double off_mm = 0.0;
    if (isnan(b->height_mm)) b->height_mm = b->radius_mm;
    if (b->height_mm > b->radius_mm)
        return bowl_fault(err, "height_mm", "it is larger than the radius, so that the rim would be above the fiber");
    for (size_t k = 0; k < 3; k++) off_mm += b->fiber_mm[k] * b->fiber_mm[k];
    if (!(sqrt(off_mm) < 0.2 * b->radius_mm)) {
        snprintf(text, sizeof text,
                 "the fiber is %.3g mm from the center of a bowl of radius %.3g mm, not within a "
                 "fifth of it",
                 sqrt(off_mm), b->radius_mm);
        return bowl_fault(err, "fiber_mm", text);
    }
    if (b->fiber_mm[2] < b->height_mm - b->radius_mm)
        return bowl_fault(err, "fiber_mm", "the fiber is below the rim of the bowl");
    if (b->n_mark < 4) return bowl_fault(err, "marks", "the place of the camera follows from 4 marks or more");
    status s = STATUS_OK;
    for (size_t i = 0; i < b->n_photograph && s == STATUS_OK; i++) s = check_lamp(b, i, err);
    return s;
}
