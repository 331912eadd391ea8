/* Checks of the option table that the range of one number cannot express, and checks that relate several options. Each
 * returns STATUS_INVALID with the key at fault and a text that names the allowed values. */
#ifndef SELVEDGE_OPTIMIZER_OPTION_CHECKS_H
#define SELVEDGE_OPTIMIZER_OPTION_CHECKS_H

#include "base/status.h"
#include "optimizer/job/document/job_sections.h"

#include <jansson.h>

struct job_option;
struct job_surface_picture;

/* A value for a check. It and all options of earlier rows have been read. */
struct option_value {
    const struct job_option *row;
    const json_t *value;
    const char *path; /* "photographs[3].crop_px" */
    void *target;
    void *own; /* the section struct that target is in, which a check may complete */
    const struct job_sections *section;
};

status job_check_document(const struct option_value *v, struct error *err);
status job_check_sample(const struct option_value *v, struct error *err);
status job_check_composition(const struct option_value *v, struct error *err);
/* the cloth */
/* Refuses ids that could leave the folder of the jobs; of any option that is the id of a job. */
status job_check_job_id(const struct option_value *v, struct error *err);
status job_check_volume(const struct option_value *v, struct error *err);
status job_check_raw(const struct option_value *v, struct error *err);
status job_check_axes(const struct option_value *v, struct error *err);
status job_check_matrix(const struct option_value *v, struct error *err);
status job_check_crop_voxel(const struct option_value *v, struct error *err);
status job_check_filter(const struct option_value *v, struct error *err);
/* Also makes job_cloth.description of the section and checks it. */
status job_check_cloth(const struct option_value *v, struct error *err);
/* Reads the numbers of the section "correction". */
status job_check_correction(const struct option_value *v, struct error *err);
/* Also reads the names of the groups of fibers. */
status job_check_fibers(const struct option_value *v, struct error *err);
/* the profile of a fiber */
/* Of a job with a profile: nothing of a cloth is given, and the models are of fibers, and have
 * the mode that the profile shows alone; one of them has the turn that is stated. */
status job_check_profile_document(const struct option_value *v, struct error *err);
/* Exactly one of a table and a bowl. */
status job_check_profile(const struct option_value *v, struct error *err);
/* The shape of the bowl, the place of the fiber, the marks and the lamps. */
status job_check_bowl(const struct option_value *v, struct error *err);
/* the set-up and the photographs */
status job_check_lamp(const struct option_value *v, struct error *err);
status job_check_camera(const struct option_value *v, struct error *err);
status job_check_light_theta(const struct option_value *v, struct error *err);
status job_check_crop_px(const struct option_value *v, struct error *err);
/* Exactly one of chart and white reference. */
status job_check_color(const struct option_value *v, struct error *err);
status job_check_measured_rows(const struct option_value *v, struct error *err);
status job_check_photographs(const struct option_value *v, struct error *err);
/* the fit */
status job_check_fit(const struct option_value *v, struct error *err);
status job_check_fit_radius(const struct option_value *v, struct error *err);
status job_check_nuisance(const struct option_value *v, struct error *err);
status job_check_texture(const struct option_value *v, struct error *err);
/* Each picture names a mesh where it is to lie on one, and nowhere else; its lamp can light it. */
status job_check_pictures(const struct option_value *v, struct error *err);
/* Fills in what the kind of picture i decides, whose document is `given`. STATUS_INVALID for a key that the kind does
 * not take, and for one that it lacks. */
status job_picture_complete(const json_t *given, size_t i, struct job_surface_picture *picture, struct error *err);
status job_check_report_file(const struct option_value *v, struct error *err);
status job_check_result_file(const struct option_value *v, struct error *err);
status job_check_twin(const struct option_value *v, struct error *err);
/* Also makes the built-in grid of candidates when the document asks for it. */
status job_check_candidates(const struct option_value *v, struct error *err);
/* Exports need a fitted model. */
status job_check_export(const struct option_value *v, struct error *err);

/* Id of model i and of method i in the catalogues; NULL after the last. */
const char *job_model_id(size_t i);
const char *job_method_id(size_t i);

#endif
