#include "optimizer/job/document/job_document.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/job_setup.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void release_sections(struct job_document *doc)
{
    free(doc->scan);
    free(doc->cloth);
    free(doc->setup);
    free(doc->rows);
    free(doc->profile);
    free(doc->fit);
    free(doc->results);
}

struct job_document *job_document_new(void)
{
    struct job_document *doc = calloc(1, sizeof *doc);
    if (doc == NULL) return NULL;
    doc->scan = calloc(1, sizeof *doc->scan);
    doc->cloth = calloc(1, sizeof *doc->cloth);
    doc->setup = calloc(1, sizeof *doc->setup);
    doc->rows = calloc(1, sizeof *doc->rows);
    doc->profile = calloc(1, sizeof *doc->profile);
    doc->fit = calloc(1, sizeof *doc->fit);
    doc->results = calloc(1, sizeof *doc->results);
    if (doc->scan != NULL && doc->cloth != NULL && doc->setup != NULL && doc->rows != NULL && doc->profile != NULL &&
        doc->fit != NULL && doc->results != NULL)
        return doc;
    release_sections(doc);
    free(doc);
    return NULL;
}

void job_document_free(struct job_document *doc)
{
    if (doc == NULL) return;
    free(doc->scan->file);
    free(doc->cloth->yarn);
    free(doc->cloth->description);
    for (size_t i = 0; i < doc->rows->n_photograph; i++) free(doc->rows->photograph[i].exposure);
    free(doc->rows->photograph);
    for (size_t i = 0; i < doc->profile->bowl.n_photograph; i++)
        free(doc->profile->bowl.photograph[i].picture.exposure);
    free(doc->profile->bowl.photograph);
    free(doc->profile->bowl.mark);
    free(doc->rows->measured_row);
    free(doc->setup->dark_frame);
    free(doc->fit->candidate);
    free(doc->results->surface_picture);
    release_sections(doc);
    free(doc);
}

bool job_profile_given(const struct job_profile *profile) { return profile->file[0] != '\0' || profile->bowl.given; }

const char *job_profile_name(const struct job_profile *profile)
{
    return profile->bowl.given ? profile->bowl.photograph[0].picture.file : profile->file;
}

struct job_sections job_document_sections(const struct job_document *doc)
{
    return (struct job_sections){.sample = doc->sample,
                                 .scan = doc->scan,
                                 .cloth = doc->cloth,
                                 .setup = doc->setup,
                                 .rows = doc->rows,
                                 .profile = doc->profile,
                                 .fit = doc->fit,
                                 .results = doc->results};
}

enum job_kind job_document_kind(const struct job_document *doc)
{
    if (doc->rows->n_photograph > 0 || doc->rows->measurement_file[0] != '\0') return JOB_OF_FIT;
    if (job_profile_given(doc->profile)) return JOB_OF_PROFILE;
    return doc->results->n_surface_picture > 0 ? JOB_OF_PICTURES : JOB_OF_GEOMETRY;
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

void job_document_visit_files(const struct job_document *doc,
                              void (*visit)(void *context, const char *name, const char *role), void *context)
{
    for (size_t i = 0; i < doc->scan->n_file; i++) visit(context, doc->scan->file[i], "volume");
    if (doc->cloth->fiber_file[0] != '\0') visit(context, doc->cloth->fiber_file, "fibers");
    if (doc->cloth->texture[0] != '\0') visit(context, doc->cloth->texture, "photograph");
    if (doc->setup->environment_file[0] != '\0') visit(context, doc->setup->environment_file, "environment");
    if (doc->rows->measurement_file[0] != '\0') visit(context, doc->rows->measurement_file, "measurements");
    if (doc->profile->file[0] != '\0') visit(context, doc->profile->file, "profile");
    visit_bowl(&doc->profile->bowl, visit, context);
    if (doc->setup->rig_file[0] != '\0') visit(context, doc->setup->rig_file, "rig");
    if (doc->setup->noise_file[0] != '\0') visit(context, doc->setup->noise_file, "camera_noise");
    for (size_t i = 0; i < doc->setup->n_dark_frame; i++) visit(context, doc->setup->dark_frame[i], "dark_frame");
    if (doc->setup->chart.file[0] != '\0') visit(context, doc->setup->chart.file, "chart");
    if (doc->setup->white.file[0] != '\0') visit(context, doc->setup->white.file, "white_reference");
    for (size_t i = 0; i < doc->rows->n_photograph; i++) {
        visit(context, doc->rows->photograph[i].file, "photograph");
        for (size_t j = 0; j < doc->rows->photograph[i].n_exposure; j++)
            visit(context, doc->rows->photograph[i].exposure[j].file, "photograph");
    }
    for (size_t i = 0; i < doc->results->n_surface_picture; i++)
        if (doc->results->surface_picture[i].mesh_file[0] != '\0')
            visit(context, doc->results->surface_picture[i].mesh_file, "mesh");
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

static void listed_file_key(const struct job_document *doc, const char *name, char *key, size_t n_key)
{
    for (size_t i = 0; i < doc->scan->n_file; i++)
        if (strcmp(doc->scan->file[i], name) == 0) snprintf(key, n_key, "volume.files[%zu]", i);
    for (size_t i = 0; i < doc->setup->n_dark_frame; i++)
        if (strcmp(doc->setup->dark_frame[i], name) == 0) snprintf(key, n_key, "camera.dark_frames[%zu]", i);
    for (size_t i = 0; i < doc->rows->n_photograph; i++) {
        const struct job_photograph *p = &doc->rows->photograph[i];
        if (strcmp(p->file, name) == 0) snprintf(key, n_key, "photographs[%zu].file", i);
        for (size_t j = 0; j < p->n_exposure; j++)
            if (strcmp(p->exposure[j].file, name) == 0)
                snprintf(key, n_key, "photographs[%zu].more_exposures[%zu].file", i, j);
    }
    for (size_t i = 0; i < doc->results->n_surface_picture; i++)
        if (strcmp(doc->results->surface_picture[i].mesh_file, name) == 0)
            snprintf(key, n_key, "pictures[%zu].mesh_file", i);
}

void job_document_file_key(const struct job_document *doc, const char *name, char *key, size_t n_key)
{
    const struct {
        const char *file, *key;
    } single[] = {{doc->cloth->fiber_file, "fibers.file"},
                  {doc->rows->measurement_file, "measurements.file"},
                  {doc->cloth->texture, "cloth.texture"},
                  {doc->setup->environment_file, "environment.file"},
                  {doc->setup->rig_file, "rig.file"},
                  {doc->profile->file, "profile.file"},
                  {doc->profile->bowl.mask, "profile.bowl.mask"},
                  {doc->setup->noise_file, "camera.noise_file"},
                  {doc->setup->chart.file, "color.chart.file"},
                  {doc->setup->white.file, "color.white.file"}};
    snprintf(key, n_key, "%s", "");
    for (size_t i = 0; i < sizeof single / sizeof single[0]; i++)
        if (strcmp(single[i].file, name) == 0) snprintf(key, n_key, "%s", single[i].key);
    listed_file_key(doc, name, key, n_key);
    bowl_file_key(&doc->profile->bowl, name, key, n_key);
}
