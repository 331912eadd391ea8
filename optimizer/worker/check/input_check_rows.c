#include "base/catalogue/model_catalogue.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "base/warning.h"
#include "optimizer/fit/baseline/row_consistency.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_sections.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/camera/photograph_process_load.h"
#include "optimizer/photographs/profile/bowl_profile.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/photographs/rows/brdf_file.h"
#include "optimizer/photographs/rows/measurement_table.h"
#include "optimizer/photographs/rows/observation_check.h"
#include "optimizer/photographs/rows/observation_load.h"
#include "optimizer/worker/check/input_check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_TABLE_BYTES = 16 << 20, MAX_LINE_FAULT = 20 };

/* Returns whether all files of a photograph are there. */
static bool has_files(const struct input_check *c, const struct job_photograph *p)
{
    bool all = input_check_has(c, p->file);
    for (size_t i = 0; i < p->n_exposure; i++) all = all && input_check_has(c, p->exposure[i].file);
    return all;
}

/* Develops and measures one photograph. */
static status measure(const struct input_check *c, const struct photograph_process *process,
                      const struct job_photograph *p, struct error *fault)
{
    struct photograph_mean mean;
    struct image im;
    status s = photograph_develop(process, c->folder, p, &im, &mean.record, fault);
    if (s != STATUS_OK) return s;
    s = photograph_measure_image(&im, p->file, p->transfer, &mean, fault);
    image_release(&im);
    return s;
}

/* Opens every photograph, also after one that cannot be used. Returns whether all can be. */
static bool check_photographs(struct input_check *c, const struct photograph_process *process)
{
    bool all = true;
    for (size_t i = 0; i < c->section.rows->n_photograph; i++) {
        struct error fault = {0};
        const struct job_photograph *p = &c->section.rows->photograph[i];
        if (has_files(c, p) && measure(c, process, p, &fault) == STATUS_OK) continue;
        all = false;
        if (fault.code == STATUS_OK) continue; /* a file is missing, which is a fault already */
        snprintf(fault.field, sizeof fault.field, OPTION_PHOTOGRAPH_FILE "[%zu]", p->index);
        input_check_fault(c, &fault);
    }
    return all;
}

/* Parses a table of the lines that are no rows and one row. */
static status parse_one(struct input_check *c, const char *head, const char *row, size_t n_row, size_t i_line,
                        struct error *fault)
{
    struct observation_set rows;
    size_t n_head = strlen(head), n_pad = i_line;
    char *text = malloc(n_head + n_pad + n_row + 2);
    if (text == NULL) return STATUS_OK;
    /* comment lines in place of the earlier rows, so that errors name the right line */
    memcpy(text, head, n_head);
    size_t at = n_head, n_line = 0;
    for (const char *p = head; *p != '\0'; p++) n_line += *p == '\n';
    for (; n_line + 1 < i_line; n_line++) text[at++] = '\n';
    memcpy(text + at, row, n_row);
    at += n_row;
    text[at++] = '\n';
    text[at] = '\0';
    observation_set_init(&rows);
    status s = measurement_table_parse(text, at, c->section.rows->measurement_file, c->section.setup, &rows, fault);
    observation_set_release(&rows);
    free(text);
    return s;
}

/* Finds all wrong lines of a table that cannot be read as a whole. */
static void check_lines(struct input_check *c, char *text)
{
    size_t i_line = 0, n_fault = 0;
    char *head_end = NULL, *next;
    for (char *line = text; *line != '\0' && n_fault < MAX_LINE_FAULT; line = next) {
        size_t n = strcspn(line, "\n");
        next = line + n + (line[n] == '\n');
        i_line++;
        bool empty = n == 0 || line[0] == '#' || line[0] == '\r';
        if (head_end == NULL && !empty) {
            head_end = next;
            continue;
        }
        if (empty || head_end == NULL) continue;
        struct error fault = {0};
        char kept = *head_end;
        char *row = malloc(n + 1);
        if (row == NULL) return;
        memcpy(row, line, n);
        row[n] = '\0';
        *head_end = '\0';
        status s = parse_one(c, text, row, n, i_line, &fault);
        *head_end = kept;
        free(row);
        /* a row of the set "held-out" alone is no table, but it is no wrong line either */
        if (s == STATUS_OK || strstr(fault.text, "held-out") != NULL || strstr(fault.text, "no row") != NULL) continue;
        input_check_fault(c, &fault);
        n_fault++;
    }
}

/* Returns whether the table can be used. */
static bool check_table(struct input_check *c)
{
    char path[INPUT_PATH_BYTES], *text = NULL;
    size_t n = 0;
    struct observation_set rows;
    struct error fault = {0};
    if (!input_check_has(c, c->section.rows->measurement_file)) return false;
    if (brdf_reader_of_name(c->section.rows->measurement_file) != NULL) return true; /* judge_rows reads it */
    input_check_path(c, c->section.rows->measurement_file, path);
    observation_set_init(&rows);
    status s = file_read_all(path, MAX_TABLE_BYTES, &text, &n, &fault);
    if (s == STATUS_OK)
        s = measurement_table_parse(text, n, c->section.rows->measurement_file, c->section.setup, &rows, &fault);
    if (s != STATUS_OK) {
        snprintf(fault.field, sizeof fault.field, OPTION_MEASUREMENT_FILE);
        input_check_fault(c, &fault);
        if (text != NULL && strlen(text) == n) check_lines(c, text);
    }
    observation_set_release(&rows);
    free(text);
    return s == STATUS_OK;
}

/* Warns where the fitted rows have fewer values than a model has parameters of its own that are fitted. */
static void warn_few_rows(struct input_check *c, const struct observation_set *rows)
{
    const struct job_fit *fit = c->section.fit;
    const size_t n_row = observation_set_count(rows, JOB_SET_FIT);
    for (size_t m = 0; m < fit->n_model; m++) {
        const struct model_info *model = model_catalogue_find(fit->model[m].id);
        size_t n_free = 0;
        if (model == NULL) continue;
        for (size_t p = 0; p < model->n_param; p++)
            n_free += isnan(fit->model[m].fixed[p]) && fit->model[m].option.leader[p] == p;
        if (3 * n_row >= n_free) continue;
        char text[256];
        snprintf(text, sizeof text,
                 "%zu fitted rows have %zu values, and %s has %zu parameters to fit: not all of them can be determined",
                 n_row, 3 * n_row, model->id, n_free);
        input_check_warn(c, OPTION_MODEL, text);
    }
}

static void judge_rows(struct input_check *c, const struct photograph_process *process)
{
    struct observation_set rows;
    struct error fault = {0};
    const struct warning_sink warn = {input_check_warn, c};
    observation_set_init(&rows);
    status s = observation_set_load(c->section.setup, c->section.rows, c->section.fit, c->folder, process, &warn, &rows,
                                    &fault);
    if (s == STATUS_OK && c->section.rows->measurement_file[0] != '\0')
        s = row_consistency_check_angles(&rows, OPTION_MEASUREMENT_FILE, &fault);
    if (s == STATUS_OK) {
        observation_set_check(&rows, &warn);
        warn_few_rows(c, &rows);
        s = row_consistency_warn(&rows, &warn, &fault);
    }
    if (s != STATUS_OK) input_check_fault(c, &fault);
    observation_set_release(&rows);
}

struct photographs_there {
    const struct input_check *check;
    bool all;
};

static void look_for_photograph(void *context, const char *name, const char *role)
{
    struct photographs_there *there = context;
    (void)role;
    there->all = input_check_has(there->check, name) && there->all;
}

/* The profile of a fiber, which a job has in place of a cloth. */
static void check_profile(struct input_check *c)
{
    struct fiber_profile profile;
    struct error fault = {0};
    struct photographs_there there = {c, true};
    if (c->section.profile->bowl.given)
        job_sections_visit_files(&c->section, look_for_photograph, &there);
    else
        there.all = input_check_has(c, c->section.profile->file);
    if (!there.all) return;
    if ((c->section.profile->bowl.given
             ? bowl_profile_load(&profile, &c->section.profile->bowl, c->setup, c->rows, c->folder, NULL, &fault)
             : fiber_profile_load(&profile, c->section.profile, c->folder, &fault)) == STATUS_OK)
        fiber_profile_release(&profile);
    else
        input_check_fault(c, &fault);
}

void input_check_rows(struct input_check *c)
{
    const struct warning_sink warn = {input_check_warn, c};
    struct photograph_process process;
    struct error fault = {0};
    bool usable;
    if (job_sections_kind(&c->section) == JOB_OF_PROFILE) check_profile(c);
    if (job_sections_kind(&c->section) != JOB_OF_FIT) return;
    photograph_process_init(&process);
    process.files = c->files;
    process.warn = &warn;
    if (c->section.rows->measurement_file[0] != '\0')
        usable = check_table(c);
    else {
        bool loaded = photograph_process_load(&process, c->setup, c->rows, c->folder, &fault) == STATUS_OK;
        if (!loaded) { /* the photographs are opened all the same, as if nothing were known of the camera */
            input_check_fault(c, &fault);
            photograph_process_release(&process);
            photograph_process_init(&process);
            process.files = c->files;
        }
        usable = check_photographs(c, &process) && loaded;
    }
    if (usable) judge_rows(c, &process);
    photograph_process_release(&process);
}
