/* The sections of one job document, for code that reads some of them and includes the headers of these sections. */
#ifndef SELVEDGE_OPTIMIZER_JOB_SECTIONS_H
#define SELVEDGE_OPTIMIZER_JOB_SECTIONS_H

struct job_scan;
struct job_cloth;
struct job_setup;
struct job_rows;
struct job_profile;
struct job_fit;
struct job_results;

/* All point into the document. */
struct job_sections {
    const char *sample;
    const struct job_scan *scan;
    const struct job_cloth *cloth;
    const struct job_setup *setup;
    const struct job_rows *rows;
    const struct job_profile *profile;
    const struct job_fit *fit;
    const struct job_results *results;
};

#endif
