/* "candidates" of the section "fit": configurations of which the most telling one is named, a list or a grid. */
#include "optimizer/job/job_document_parts.h"

#include <stdio.h>
#include <stdlib.h>

static const double light_theta[] = {20, 45, 65, 80}, camera_theta[] = {0, 30, 60, 75}, camera_phi[] = {180, 90},
                    rotation[] = {0, 90};

/* Lamp at phi 0, camera opposite or beside it, cloth along and across; with the lamp behind a cloth without its sheet. */
static status make_grid(struct job_document *doc, struct error *err)
{
    enum { FRONT = 4 * 4 * 2 * 2, BACK = 4 };
    doc->candidate = calloc(FRONT + BACK, sizeof *doc->candidate);
    if (doc->candidate == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    for (size_t i = 0; i < FRONT; i++) {
        struct job_candidate c = {light_theta[i / 16], 0.0, camera_theta[i / 4 % 4], camera_phi[i / 2 % 2],
                                  rotation[i % 2]};
        if (c.camera_theta_deg == 0.0 && c.camera_phi_deg != 180.0) continue; /* from above, phi means nothing */
        doc->candidate[doc->n_candidate++] = c;
    }
    for (size_t i = 0; i < BACK && !doc->black_sheet; i++)
        doc->candidate[doc->n_candidate++] =
            (struct job_candidate){150.0, 0.0, i / 2 ? 45.0 : 0.0, 180.0, rotation[i % 2]};
    return STATUS_OK;
}

static status parse_candidate(const struct json_field *f, const struct job_document *doc, struct job_candidate *c,
                              struct error *err)
{
    static const char *const key[] = {"light_theta_deg", "light_phi_deg",      "camera_theta_deg",
                                      "camera_phi_deg",  "cloth_rotation_deg", NULL};
    status s = json_field_check_keys(f, key, err);
    if (s == STATUS_OK) s = job_parse_light_theta(f, doc, &c->light_theta_deg, err);
    if (s == STATUS_OK) s = json_field_required_number(f, "light_phi_deg", -360.0, 360.0, &c->light_phi_deg, err);
    if (s == STATUS_OK) s = json_field_required_number(f, "camera_theta_deg", 0.0, 89.999, &c->camera_theta_deg, err);
    if (s == STATUS_OK) s = json_field_required_number(f, "camera_phi_deg", -360.0, 360.0, &c->camera_phi_deg, err);
    if (s == STATUS_OK) s = json_field_number(f, "cloth_rotation_deg", -360.0, 360.0, &c->cloth_rotation_deg, err);
    return s;
}

status job_parse_candidates(const struct json_field *fit, struct job_document *doc, struct error *err)
{
    static const char *const key[] = {"grid", NULL};
    const json_t *value = json_object_get(fit->object, "candidates");
    if (value == NULL) return STATUS_OK;
    if (json_is_object(value)) {
        struct json_field f = {.object = value, .path = "fit.candidates"};
        bool grid = false;
        status s = json_field_check_keys(&f, key, err);
        if (s == STATUS_OK) s = json_field_bool(&f, "grid", &grid, err);
        return s == STATUS_OK && grid ? make_grid(doc, err) : s;
    }
    size_t n = json_array_size(value);
    if (!json_is_array(value) || n == 0 || n > JOB_MAX_CANDIDATE)
        return error_set_field(err, STATUS_INVALID, "fit.candidates",
                               "'fit.candidates' must be a list of 1 to %d configurations, or {\"grid\": true}",
                               JOB_MAX_CANDIDATE);
    doc->candidate = calloc(n, sizeof *doc->candidate);
    if (doc->candidate == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    for (size_t i = 0; i < n; i++) {
        struct json_field f = {.object = json_array_get(value, i)};
        snprintf(f.path, sizeof f.path, "fit.candidates[%zu]", i);
        status s = parse_candidate(&f, doc, &doc->candidate[i], err);
        if (s != STATUS_OK) return s;
        doc->n_candidate++;
    }
    return STATUS_OK;
}
