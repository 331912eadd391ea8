#include "optimizer/job/document/job_sections.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/job_setup.h"

#include <stdio.h>
#include <string.h>

bool job_profile_given(const struct job_profile *profile) { return profile->file[0] != '\0' || profile->bowl.given; }

const char *job_profile_name(const struct job_profile *profile)
{
    return profile->bowl.given ? profile->bowl.photograph[0].picture.file : profile->file;
}

const char *job_profile_mode(const struct job_profile *profile)
{
    return profile->mode[0] == '\0' || strcmp(profile->mode, "all") == 0 ? NULL : profile->mode;
}

enum job_kind job_sections_kind(const struct job_sections *section)
{
    if (section->rows->n_photograph > 0 || section->rows->measurement_file[0] != '\0') return JOB_OF_FIT;
    if (job_profile_given(section->profile)) return JOB_OF_PROFILE;
    return section->results->n_surface_picture > 0 || section->fit->result_file[0] != '\0' ? JOB_OF_PICTURES
                                                                                           : JOB_OF_GEOMETRY;
}

bool job_sections_wants_pictures(const struct job_sections *section)
{
    const enum job_kind kind = job_sections_kind(section);
    const bool shows_own = kind == JOB_OF_PICTURES && section->fit->result_file[0] == '\0';
    return (kind == JOB_OF_FIT || shows_own) && !section->results->no_pictures;
}

/* ---- input files ---- */

/* Several photographs of a bowl may name one background. */
static void visit_bowl(const struct job_bowl *bowl, void (*visit)(void *context, const char *name, const char *role),
                       void *context)
{
    if (bowl->mask[0] != '\0') visit(context, bowl->mask, "photograph");
    for (size_t i = 0; i < bowl->n_photograph; i++) {
        const struct job_bowl_photograph *p = &bowl->photograph[i];
        bool again = p->background[0] == '\0';
        for (size_t j = 0; j < i; j++) again = again || strcmp(bowl->photograph[j].background, p->background) == 0;
        visit(context, p->picture.file, "photograph");
        for (size_t j = 0; j < p->picture.n_exposure; j++) visit(context, p->picture.exposure[j].file, "photograph");
        if (!again) visit(context, p->background, "photograph");
    }
}

void job_sections_visit_files(const struct job_sections *section,
                              void (*visit)(void *context, const char *name, const char *role), void *context)
{
    for (size_t i = 0; i < section->scan->n_file; i++) visit(context, section->scan->file[i], "volume");
    if (section->cloth->fiber_file[0] != '\0') visit(context, section->cloth->fiber_file, "fibers");
    if (section->cloth->draft_file[0] != '\0') visit(context, section->cloth->draft_file, "draft");
    if (section->cloth->texture[0] != '\0') visit(context, section->cloth->texture, "photograph");
    if (section->setup->environment_file[0] != '\0') visit(context, section->setup->environment_file, "environment");
    if (section->rows->measurement_file[0] != '\0') visit(context, section->rows->measurement_file, "measurements");
    if (section->fit->result_file[0] != '\0') visit(context, section->fit->result_file, "result");
    if (section->results->report_file[0] != '\0') visit(context, section->results->report_file, "report");
    if (section->profile->file[0] != '\0') visit(context, section->profile->file, "profile");
    visit_bowl(&section->profile->bowl, visit, context);
    if (section->setup->rig_file[0] != '\0') visit(context, section->setup->rig_file, "rig");
    if (section->setup->noise_file[0] != '\0') visit(context, section->setup->noise_file, "camera_noise");
    for (size_t i = 0; i < section->setup->n_dark_frame; i++)
        visit(context, section->setup->dark_frame[i], "dark_frame");
    if (section->setup->chart.file[0] != '\0') visit(context, section->setup->chart.file, "chart");
    if (section->setup->chart_reference_file[0] != '\0')
        visit(context, section->setup->chart_reference_file, "measurements");
    if (section->setup->white.file[0] != '\0') visit(context, section->setup->white.file, "white_reference");
    for (size_t i = 0; i < section->rows->n_photograph; i++) {
        if (section->rows->photograph[i].column.number > 1) continue; /* of the same files as the first column */
        visit(context, section->rows->photograph[i].file, "photograph");
        for (size_t j = 0; j < section->rows->photograph[i].n_exposure; j++)
            visit(context, section->rows->photograph[i].exposure[j].file, "photograph");
    }
    for (size_t i = 0; i < section->results->n_surface_picture; i++)
        if (section->results->surface_picture[i].mesh_file[0] != '\0')
            visit(context, section->results->surface_picture[i].mesh_file, "mesh");
}

static void bowl_file_key(const struct job_bowl *bowl, const char *name, char *key, size_t n_key)
{
    for (size_t i = 0; i < bowl->n_photograph; i++) {
        const struct job_bowl_photograph *p = &bowl->photograph[i];
        if (strcmp(p->picture.file, name) == 0) snprintf(key, n_key, "profile.bowl.photographs[%zu].file", i);
        if (strcmp(p->background, name) == 0) snprintf(key, n_key, "profile.bowl.photographs[%zu].background", i);
        for (size_t j = 0; j < p->picture.n_exposure; j++)
            if (strcmp(p->picture.exposure[j].file, name) == 0)
                snprintf(key, n_key, "profile.bowl.photographs[%zu].more_exposures[%zu].file", i, j);
    }
}

static void listed_file_key(const struct job_sections *section, const char *name, char *key, size_t n_key)
{
    for (size_t i = 0; i < section->scan->n_file; i++)
        if (strcmp(section->scan->file[i], name) == 0) snprintf(key, n_key, "volume.files[%zu]", i);
    for (size_t i = 0; i < section->setup->n_dark_frame; i++)
        if (strcmp(section->setup->dark_frame[i], name) == 0) snprintf(key, n_key, "camera.dark_frames[%zu]", i);
    for (size_t i = 0; i < section->rows->n_photograph; i++) {
        const struct job_photograph *p = &section->rows->photograph[i];
        if (strcmp(p->file, name) == 0) snprintf(key, n_key, "photographs[%zu].file", p->index);
        for (size_t j = 0; j < p->n_exposure; j++)
            if (strcmp(p->exposure[j].file, name) == 0)
                snprintf(key, n_key, "photographs[%zu].more_exposures[%zu].file", p->index, j);
    }
    for (size_t i = 0; i < section->results->n_surface_picture; i++)
        if (strcmp(section->results->surface_picture[i].mesh_file, name) == 0)
            snprintf(key, n_key, "pictures[%zu].mesh_file", i);
}

void job_sections_file_key(const struct job_sections *section, const char *name, char *key, size_t n_key)
{
    const struct {
        const char *file, *key;
    } single[] = {{section->cloth->fiber_file, "fibers.file"},
                  {section->rows->measurement_file, "measurements.file"},
                  {section->cloth->draft_file, "cloth.draft_file"},
                  {section->cloth->texture, "cloth.texture"},
                  {section->setup->environment_file, "environment.file"},
                  {section->setup->rig_file, "rig.file"},
                  {section->fit->result_file, "fit.result_file"},
                  {section->results->report_file, "export.report_file"},
                  {section->profile->file, "profile.file"},
                  {section->profile->bowl.mask, "profile.bowl.mask"},
                  {section->setup->noise_file, "camera.noise_file"},
                  {section->setup->chart.file, "color.chart.file"},
                  {section->setup->chart_reference_file, "color.chart.reference"},
                  {section->setup->white.file, "color.white.file"}};
    snprintf(key, n_key, "%s", "");
    for (size_t i = 0; i < sizeof single / sizeof single[0]; i++)
        if (strcmp(single[i].file, name) == 0) snprintf(key, n_key, "%s", single[i].key);
    listed_file_key(section, name, key, n_key);
    bowl_file_key(&section->profile->bowl, name, key, n_key);
}
