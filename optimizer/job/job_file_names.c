/* Names of input files: which names are allowed, a visit to all input files of a document, and the key of one. */
#include "optimizer/job/job_document.h"

#include <stdio.h>
#include <string.h>

static const char name_allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";

bool job_file_name_valid(const char *name)
{
    size_t n = strlen(name);
    if (n == 0 || n >= JOB_MAX_NAME_BYTES || name[0] == '.') return false;
    return strspn(name, name_allowed) == n;
}

void job_file_name_make_valid(const char *text, char name[JOB_MAX_NAME_BYTES])
{
    snprintf(name, JOB_MAX_NAME_BYTES, "%s", text);
    if (name[0] == '.' || name[0] == '\0') snprintf(name, JOB_MAX_NAME_BYTES, "_%s", text[0] != '\0' ? text + 1 : "");
    for (char *p = name + strspn(name, name_allowed); *p != '\0'; p += strspn(p, name_allowed)) *p = '_';
}

status job_check_file_name(const char *path, const char *name, struct error *err)
{
    if (job_file_name_valid(name)) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, path,
        "'%s' is '%.140s': a file name has 1 to %d characters out of A-Z a-z 0-9 . _ - and does not start with a dot",
        path, name, JOB_MAX_NAME_BYTES - 1);
}

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
    for (size_t i = 0; i < doc->n_volume_file; i++) visit(context, doc->volume_file[i], "volume");
    if (doc->fiber_file[0] != '\0') visit(context, doc->fiber_file, "fibers");
    if (doc->cloth_texture[0] != '\0') visit(context, doc->cloth_texture, "photograph");
    if (doc->environment_file[0] != '\0') visit(context, doc->environment_file, "environment");
    if (doc->measurement_file[0] != '\0') visit(context, doc->measurement_file, "measurements");
    if (doc->profile_file[0] != '\0') visit(context, doc->profile_file, "profile");
    visit_bowl(&doc->bowl, visit, context);
    if (doc->rig_file[0] != '\0') visit(context, doc->rig_file, "rig");
    if (doc->noise_file[0] != '\0') visit(context, doc->noise_file, "camera_noise");
    for (size_t i = 0; i < doc->n_dark_frame; i++) visit(context, doc->dark_frame[i], "dark_frame");
    if (doc->chart.file[0] != '\0') visit(context, doc->chart.file, "chart");
    if (doc->white.file[0] != '\0') visit(context, doc->white.file, "white_reference");
    for (size_t i = 0; i < doc->n_photograph; i++) {
        visit(context, doc->photograph[i].file, "photograph");
        for (size_t j = 0; j < doc->photograph[i].n_exposure; j++)
            visit(context, doc->photograph[i].exposure[j].file, "photograph");
    }
    for (size_t i = 0; i < doc->n_surface_picture; i++)
        if (doc->surface_picture[i].mesh_file[0] != '\0') visit(context, doc->surface_picture[i].mesh_file, "mesh");
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
    for (size_t i = 0; i < doc->n_volume_file; i++)
        if (strcmp(doc->volume_file[i], name) == 0) snprintf(key, n_key, "volume.files[%zu]", i);
    for (size_t i = 0; i < doc->n_dark_frame; i++)
        if (strcmp(doc->dark_frame[i], name) == 0) snprintf(key, n_key, "camera.dark_frames[%zu]", i);
    for (size_t i = 0; i < doc->n_photograph; i++) {
        const struct job_photograph *p = &doc->photograph[i];
        if (strcmp(p->file, name) == 0) snprintf(key, n_key, "photographs[%zu].file", i);
        for (size_t j = 0; j < p->n_exposure; j++)
            if (strcmp(p->exposure[j].file, name) == 0)
                snprintf(key, n_key, "photographs[%zu].more_exposures[%zu].file", i, j);
    }
    for (size_t i = 0; i < doc->n_surface_picture; i++)
        if (strcmp(doc->surface_picture[i].mesh_file, name) == 0) snprintf(key, n_key, "pictures[%zu].mesh_file", i);
}

void job_document_file_key(const struct job_document *doc, const char *name, char *key, size_t n_key)
{
    const struct {
        const char *file, *key;
    } single[] = {{doc->fiber_file, "fibers.file"},      {doc->measurement_file, "measurements.file"},
                  {doc->cloth_texture, "cloth.texture"}, {doc->environment_file, "environment.file"},
                  {doc->rig_file, "rig.file"},           {doc->profile_file, "profile.file"},
                  {doc->bowl.mask, "profile.bowl.mask"}, {doc->noise_file, "camera.noise_file"},
                  {doc->chart.file, "color.chart.file"}, {doc->white.file, "color.white.file"}};
    snprintf(key, n_key, "%s", "");
    for (size_t i = 0; i < sizeof single / sizeof single[0]; i++)
        if (strcmp(single[i].file, name) == 0) snprintf(key, n_key, "%s", single[i].key);
    listed_file_key(doc, name, key, n_key);
    bowl_file_key(&doc->bowl, name, key, n_key);
}
