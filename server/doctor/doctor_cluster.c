/* Whether the cluster of the settings takes jobs. Nothing is submitted: Slurm is asked whether it would take one. */
#include "server/doctor/doctor_report.h"
#include "server/workers/backends/slurm_request.h"

#include <stdlib.h>
#include <string.h>

/* The request of a job without files, for a test alone. */
static status make_request(const struct doctor *d, const char *sbatch, struct slurm_need need,
                           struct slurm_request *request, struct error *err)
{
    struct job_row *row = calloc(1, sizeof *row);
    size_t n = 0;
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot ask Slurm: out of memory");
    snprintf(row->id, sizeof row->id, "doctor");
    snprintf(row->sample, sizeof row->sample, "doctor");
    const struct slurm_submission submission = {.sbatch = sbatch, .program = d->worker, .row = row, .need = need};
    status s = slurm_request_make(d->settings, &submission, request, err);
    free(row);
    while (request->argument[n] != NULL) n++;
    if (s == STATUS_OK && n >= SLURM_MAX_ARGUMENT)
        return error_set(err, STATUS_INVALID, "slurm.extra_arguments has too many options");
    if (s == STATUS_OK) request->argument[n] = "--test-only";
    return s;
}

static status ask(struct doctor *d, struct slurm_request *request, struct error *err)
{
    static const char *const command[] = {"sbatch", "squeue", "scancel", "srun"};
    const int n_command = d->settings->slurm_ranks > 1 ? 4 : 3;
    char path[4][PATH_BYTES];
    struct slurm_output out = {0};
    const struct slurm_need need = slurm_need_of(d->settings, NULL, 0, (struct slurm_memory){0});
    status s = slurm_request_check(d->settings, err);
    for (int i = 0; i < n_command && s == STATUS_OK; i++)
        s = slurm_command_find(d->settings, command[i], path[i], sizeof path[i], err);
    if (s == STATUS_OK) s = make_request(d, path[0], need, request, err);
    if (s == STATUS_OK) s = slurm_command_run(d->settings, request->argument, request->script, NULL, &out, err);
    if (s != STATUS_OK) return s;
    if (out.code == 0)
        doctor_say(d, DOCTOR_OK, "cluster", "Slurm would take a job of %lld cores and %lld MiB", (long long)need.cores,
                   (long long)(need.memory_bytes >> 20));
    else
        doctor_say(d, DOCTOR_FAULT, "cluster", "Slurm takes no job of %lld cores and %lld MiB: %s",
                   (long long)need.cores, (long long)(need.memory_bytes >> 20), out.error);
    free(out.text);
    return STATUS_OK;
}

void doctor_examine_cluster(struct doctor *d)
{
    struct error err = {0};
    if (strcmp(d->settings->backend, "slurm") != 0) return;
    struct slurm_request *request = malloc(sizeof *request);
    status s = request != NULL ? ask(d, request, &err) : STATUS_NO_MEMORY;
    if (s != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "cluster", "%s", request != NULL ? err.text : "cannot ask Slurm: out of memory");
    free(request);
}
