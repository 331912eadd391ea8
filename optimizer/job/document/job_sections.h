/* The sections of one job document, read only, for code that reads some of them and includes the headers of these
 * sections. */
#ifndef SELVEDGE_OPTIMIZER_JOB_SECTIONS_H
#define SELVEDGE_OPTIMIZER_JOB_SECTIONS_H

#include <stdbool.h>
#include <stddef.h>

struct job_scan;
struct job_cloth;
struct job_setup;
struct job_rows;
struct job_profile;
struct job_fit;
struct job_results;

/* All point into the document. */
struct job_sections {
    const struct job_scan *scan;
    const struct job_cloth *cloth;
    const struct job_setup *setup;
    const struct job_rows *rows;
    const struct job_profile *profile;
    const struct job_fit *fit;
    const struct job_results *results;
};

/* The work of a job, by the sections that its document has. */
enum job_kind {
    JOB_OF_GEOMETRY, /* ends with the geometry of its scan */
    JOB_OF_PICTURES, /* shows its cloth with parameters that the document holds fixed */
    JOB_OF_FIT,      /* fits models to photographs or a table of measurements */
    JOB_OF_PROFILE   /* fits models to the profile of a single fiber; it has no cloth */
};

enum job_kind job_sections_kind(const struct job_sections *section);

/* Whether a picture and a twin are made after the result: of a cloth with a model, unless the document leaves them out.
 * Jobs that show another job's result make what they were asked for alone. */
bool job_sections_wants_pictures(const struct job_sections *section);

/* Calls visit for every input file that the document names, with its role ("volume", "fibers", "environment", "draft",
 * "measurements", "photograph", "camera_noise", "dark_frame", "chart", "white_reference", "mesh", "profile",
 * "result", "report"). */
void job_sections_visit_files(const struct job_sections *section,
                              void (*visit)(void *context, const char *name, const char *role), void *context);
/* Writes the key that names an input file, as "photographs[2].file": the last one where several do, "" where none. */
void job_sections_file_key(const struct job_sections *section, const char *name, char *key, size_t n_key);

#endif
