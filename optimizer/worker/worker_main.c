/* selvedge-worker JOBDIR: one job from its folder to its results. Layout of the folder: optimizer/job/job_folder.h. */
#include "base/files/file_tree.h"
#include "base/files/reading_note.h"
#include "base/log.h"
#include "base/process.h"
#include "base/thread_pool.h"
#include "optimizer/job/document/catalogue_json.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/worker/check/job_check.h"
#include "optimizer/worker/check/other_faults.h"
#include "optimizer/worker/job_need.h"
#include "optimizer/worker/pipeline.h"
#include "optimizer/worker/sandbox/worker_confine.h"
#include "optimizer/worker/worker_launcher.h"
#include "optimizer/worker/worker_signals.h"
#include "optimizer/worker/worker_team.h"

#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char usage[] =
    "usage: selvedge-worker [options] JOBDIR\n"
    "Run the job in JOBDIR: job.json and input/ are read, results/ is written. Run again after an interruption, it "
    "continues where it was.\n"
    "\n"
    "  --threads N        computing threads (default: one a processor); results do not depend on it\n"
    "  --memory-mib N     resident memory of the geometry stages in mebibytes (default 2048); larger volumes are\n"
    "                     worked on in files under JOBDIR/work. Results do not depend on it, but volume models of "
    "fiber\n"
    "                     files see coarser voxels (with a warning) where a quarter of it does not hold finer ones\n"
    "  --scratch-mib N    disk in mebibytes that these files may take (default: what is free); a scan that needs more "
    "is\n"
    "                     refused before it is read\n"
    "  --speeds FILE      speeds of earlier jobs, by which remaining times are predicted; those of this job are added\n"
    "  --sandbox MODE     auto (default): as far as the kernel can, keep the worker to JOBDIR and to the system calls "
    "that\n"
    "                     it needs; required: fail where the kernel cannot; off\n"
    "  --start NAME       name of this start, given by an engine that might start a worker twice: one name has an "
    "attempt\n"
    "  --ranks N          run the job with N ranks (processes that share its paths) by mpirun, and start them again "
    "when\n"
    "                     one is lost; the processors are divided among them unless --threads is given. Results do "
    "not\n"
    "                     depend on it. mpirun and srun may also start this program themselves\n"
    "  --pictures         of a job that has succeeded: make its picture in the studio and its twin, with progress in\n"
    "                     JOBDIR/pictures.json and a log of its own, JOBDIR/pictures-log.txt\n"
    "  --quiet            log to JOBDIR/log.txt only\n"
    "  --check JOB.json   check the document and its files (in JOBDIR), and print all faults and warnings as JSON;\n"
    "                     exit status 1 when there are faults\n"
    "  --plan             write nothing, and print what the job in JOBDIR is expected to take as JSON: time, "
    "processor\n"
    "                     time, memory and disk, by --speeds; exit status 1 when its inputs cannot be read\n"
    "  --no-links         refuse inputs that are links to files outside of JOBDIR, also in a folder made by hand\n"
    "  --catalogue        print the scattering models with their parameters, the descent methods and the codes that\n"
    "                     explain why a fit ended, as JSON\n"
    "  --version, --help\n"
    "\n"
    "Exit status: 0 succeeded, 1 failed (JOBDIR/status.json says why), 2 usage, 3 cancelled by SIGTERM, 4 another "
    "attempt owns the job, 75 a rank is lost.\n";

struct arguments {
    const char *folder;
    const char *speeds; /* NULL: none are remembered */
    const char *start;  /* name of this start; NULL: none */
    const char *check;  /* a document to check; NULL: the job is run */
    size_t n_thread, n_rank, memory_mib, scratch_mib;
    struct worker_team_place team;
    bool quiet, no_links, plan, pictures;
    enum confine_mode sandbox;
    struct confinement confinement;
};

static bool parse_count(const char *text, size_t upper, size_t *out)
{
    char *end;
    errno = 0;
    unsigned long long v = strtoull(text, &end, 10);
    if (errno != 0 || end == text || *end != '\0' || text[0] == '-' || v == 0 || v > upper) return false;
    *out = (size_t)v;
    return true;
}

static int print_catalogue(void)
{
    json_t *json = catalogue_json();
    bool ok = json != NULL && json_dumpf(json, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(12)) == 0;
    json_decref(json);
    return ok && putchar('\n') != EOF ? WORKER_SUCCEEDED : WORKER_FAILED;
}

static int print_check(const struct arguments *a)
{
    struct error err = {0};
    json_t *report = NULL;
    if (job_check(a->check, a->folder, &report, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-worker: %s\n", err.text);
        return WORKER_USAGE;
    }
    bool good = json_array_size(json_object_get(report, "faults")) == 0;
    bool ok = json_dumpf(report, stdout, JSON_INDENT(1)) == 0 && putchar('\n') != EOF;
    json_decref(report);
    return good && ok ? WORKER_SUCCEEDED : WORKER_FAILED;
}

static int print_plan(const struct arguments *a)
{
    struct error err = {0};
    json_t *report = NULL;
    const struct job_need_machine machine = {
        .n_thread = a->n_thread, .memory_limit_bytes = a->memory_mib << 20, .speeds = a->speeds};
    if (job_need_report(a->folder, &machine, &report, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-worker: %s\n", err.text);
        return WORKER_USAGE;
    }
    bool good = json_is_null(json_object_get(report, "error"));
    bool ok = json_dumpf(report, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(6)) == 0 && putchar('\n') != EOF;
    json_decref(report);
    return good && ok ? WORKER_SUCCEEDED : WORKER_FAILED;
}

/* An option with a value. Returns false when the value is not allowed. */
static bool take_value(int option, const char *value, struct arguments *a)
{
    switch (option) {
    case 't':
        return parse_count(value, 1024, &a->n_thread);
    case 'r':
        return parse_count(value, RANK_TEAM_MOST, &a->n_rank);
    case 'T':
        return worker_team_parse(value, &a->team);
    case 'm':
        return parse_count(value, (size_t)1 << 32, &a->memory_mib);
    case 'S':
        return parse_count(value, (size_t)1 << 32, &a->scratch_mib);
    case 'b':
        return confine_mode_parse(value, &a->sandbox);
    case 'C':
        return confinement_parse(value, &a->confinement);
    case 'N':
        a->start = value;
        return value[0] != '\0';
    case 's':
        a->speeds = value;
        return true;
    default:
        a->check = value;
        return true;
    }
}

/* Returns -1 to go on, otherwise the exit status of the program. */
static int parse_arguments(int argc, char **argv, struct arguments *a)
{
    static const struct option option[] = {{"threads", required_argument, NULL, 't'},
                                           {"ranks", required_argument, NULL, 'r'},
                                           {"team", required_argument, NULL, 'T'},
                                           {"memory-mib", required_argument, NULL, 'm'},
                                           {"scratch-mib", required_argument, NULL, 'S'},
                                           {"speeds", required_argument, NULL, 's'},
                                           {"check", required_argument, NULL, 'k'},
                                           {"plan", no_argument, NULL, 'p'},
                                           {"sandbox", required_argument, NULL, 'b'},
                                           {"confined", required_argument, NULL, 'C'},
                                           {"start", required_argument, NULL, 'N'},
                                           {"quiet", no_argument, NULL, 'q'},
                                           {"pictures", no_argument, NULL, 'P'},
                                           {"no-links", no_argument, NULL, 'l'},
                                           {"help", no_argument, NULL, 'h'},
                                           {"version", no_argument, NULL, 'v'},
                                           {"catalogue", no_argument, NULL, 'c'},
                                           {NULL, 0, NULL, 0}};
    *a = (struct arguments){.n_rank = 1,
                            .team.fd = -1,
                            .memory_mib = 2048,
                            .sandbox = CONFINE_AUTO,
                            .confinement.helper = program_helpers_none()};
    for (int c; (c = getopt_long(argc, argv, "", option, NULL)) != -1;) {
        if (c == 'h') return fputs(usage, stdout) < 0;
        if (c == 'c') return print_catalogue();
        if (c == 'v') return puts(RESULT_PROGRAM) < 0;
        if (c == 'q') a->quiet = true;
        if (c == 'l') a->no_links = true;
        if (c == '?') return fputs(usage, stderr) < 0 ? WORKER_FAILED : WORKER_USAGE;
        if (c == 'p') a->plan = true;
        if (c == 'P') a->pictures = true;
        if (c == 'q' || c == 'l' || c == 'p' || c == 'P' || take_value(c, optarg, a)) continue;
        fprintf(stderr, "selvedge-worker: '%s' is not an allowed value\n", optarg);
        return WORKER_USAGE;
    }
    if (optind != argc - 1) {
        fputs(usage, stderr);
        return WORKER_USAGE;
    }
    a->folder = argv[optind];
    return -1;
}

/* Adds the speeds and needs of this job to the file, which other jobs may have changed meanwhile. A failure here is no
 * error of the job. An attempt that went on from an earlier one, and rank 0 of several, have taken only a part of the
 * job's needs. */
static void remember_speeds(const struct job_plan *plan, const char *path, bool alone)
{
    struct speed_book book;
    struct error err = {0};
    const struct process_use used = process_use();
    const struct job_need took = {.cpu_s = used.cpu_s,
                                  .memory_bytes = (double)used.peak_rss_bytes,
                                  .disk_bytes = (double)disk_use_bytes(plan->tools->folder->path)};
    speed_book_read(path, &book);
    worker_status_remember(plan->status, &book);
    if (!plan->in->resumed && alone) job_need_remember(plan, &took, &book);
    if (speed_book_write(path, &book, &err) != STATUS_OK) log_info(plan->tools->log, "%s", err.text);
}

static status run_stages(struct stage_tools *tools, const struct arguments *a, struct job_inputs *in, struct error *err)
{
    struct speed_book book = {.n = 0};
    struct job_plan plan;
    const struct pipeline_option option = {
        .most_scratch_bytes = a->scratch_mib << 20, .helper = a->confinement.helper, .pictures = a->pictures};
    if (a->speeds != NULL) speed_book_read(a->speeds, &book);
    status s = job_inputs_read(tools, in, err);
    job_plan_init(&plan, tools, in);
    if (s == STATUS_OK) job_need_begin(&plan);
    worker_status_speeds(tools->status, &book);
    if (s == STATUS_OK && (!a->pictures || job_sections_wants_pictures(&in->section)))
        s = pipeline_run(tools, in, &option, &plan, err);
    other_faults_name(tools, s, err);
    if (s == STATUS_OK && a->speeds != NULL && !a->pictures) remember_speeds(&plan, a->speeds, a->team.fd < 0);
    return s;
}

static status run_with_inputs(struct stage_tools *tools, const struct arguments *a, struct error *err)
{
    struct job_inputs *in = malloc(sizeof *in);
    if (in == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot run the job: out of memory");
    job_inputs_init(in);
    status s = run_stages(tools, a, in, err);
    job_inputs_release(in);
    free(in);
    return s;
}

/* *lost: another rank is lost, so the status is no end of the job. */
static status run_job(struct stage_tools *tools, const struct arguments *a, bool *lost, struct error *err)
{
    struct worker_team team = {.team = NULL};
    worker_status_stage(tools->status, "volume", "Reading the job", 0, 8);
    status s = thread_pool_new(a->n_thread, &tools->pool, err);
    if (s == STATUS_OK) s = worker_team_open(&team, &a->team, tools->pool, err);
    if (s == STATUS_OK) s = run_with_inputs(tools, a, err);
    *lost = worker_team_lost(&team);
    worker_team_close(&team, tools->pool, tools->log);
    return s;
}

/* Writes the final state that follows from the outcome to status.json and the log. Returns the exit status. */
static int conclude(struct worker_status *st, struct log *log, status outcome, const struct error *error)
{
    struct error err = {0};
    int code = outcome == STATUS_OK ? WORKER_SUCCEEDED : outcome == STATUS_CANCELLED ? WORKER_CANCELLED : WORKER_FAILED;
    if (worker_status_stale(st) || outcome == STATUS_STALE) {
        log_error(log, "stopped: the attempt of this worker is no longer current");
        return WORKER_STALE;
    }
    if (code == WORKER_SUCCEEDED)
        log_info(log, "succeeded");
    else if (code == WORKER_CANCELLED)
        log_info(log, "cancelled");
    else
        log_error(log, "failed (%s%s%s): %s", status_name(outcome), error->field[0] != '\0' ? ", " : "", error->field,
                  error->text);
    const char *state = code == WORKER_SUCCEEDED ? "succeeded" : code == WORKER_CANCELLED ? "cancelled" : "failed";
    if (worker_status_finish(st, state, code == WORKER_FAILED ? error : NULL, &err) != STATUS_OK) {
        log_error(log, "%s", err.text);
        return err.code == STATUS_STALE ? WORKER_STALE : WORKER_FAILED;
    }
    return code;
}

/* Says in the log how far the sandbox goes, and warns the job's user when a part of it could not be had. It is an error
 * only where the whole sandbox is required. */
static status report_sandbox(const struct stage_tools *tools, const struct arguments *a, const struct error *failed,
                             struct error *err)
{
    char text[200];
    bool whole = confinement_describe(&a->confinement, a->sandbox, text, sizeof text);
    if (failed->code != STATUS_OK && a->sandbox == CONFINE_REQUIRED) {
        *err = *failed;
        return failed->code;
    }
    if (failed->code != STATUS_OK)
        worker_status_warn(tools->status, "the worker runs without its whole sandbox: %s", failed->text);
    else if (whole)
        log_info(tools->log, "%s", text);
    else
        worker_status_warn(tools->status, "%s", text);
    return STATUS_OK;
}

/* Another rank than the first. */
static bool is_helper(const struct arguments *a) { return a->team.fd >= 0 && a->team.rank > 0; }

/* Says where this rank has less of a sandbox than its command line asks for: the log of the job tells of rank 0. */
static void report_sandbox_of_helper(const struct arguments *a, const struct error *failed)
{
    char text[200];
    const bool whole = confinement_describe(&a->confinement, a->sandbox, text, sizeof text);
    if (failed->code != STATUS_OK)
        fprintf(stderr, "selvedge-worker: rank %zu runs without its whole sandbox: %s\n", a->team.rank, failed->text);
    else if (!whole && a->sandbox != CONFINE_OFF)
        fprintf(stderr, "selvedge-worker: rank %zu: %s\n", a->team.rank, text);
}

/* The job is not run. */
static bool files_only(const struct arguments *a) { return a->check != NULL || a->plan; }

/* Enters the sandbox. Returns only in it, or without one; report_sandbox then reports the failure. */
static void enter_sandbox(struct arguments *a, char **argv, struct error *err)
{
    struct confinement *c = &a->confinement;
    struct worker_folder job = {.lock_fd = -1};
    char document[WORKER_PATH_BYTES], input[WORKER_PATH_BYTES];
    struct confine_files files = {
        .folder = a->folder, .document = a->check, .speeds = a->speeds, .no_links = a->no_links, .none = is_helper(a)};
    if (a->plan) { /* which reads the same files as a check */
        snprintf(job.path, sizeof job.path, "%s", a->folder);
        worker_folder_path(&job, JOB_FILE_DOCUMENT, NULL, document);
        worker_folder_path(&job, JOB_FOLDER_INPUT, NULL, input);
        files.folder = input;
        files.document = document;
    }
    if (a->sandbox == CONFINE_OFF) {
        if (files.document == NULL && !is_helper(a)) worker_prepare(a->folder, c);
        return;
    }
    if (!c->executed && worker_confine(&files, argv, err) != STATUS_OK) return;
    confinement_complete(c, a->sandbox, err);
}

int main(int argc, char **argv)
{
    struct arguments a;
    struct worker_folder folder;
    struct stage_tools tools;
    struct error err = {0}, failed = {0};
    char log_path[WORKER_PATH_BYTES];
    int code = parse_arguments(argc, argv, &a);
    if (code < 0 && !files_only(&a) && !a.team.given && !a.confinement.executed)
        code = worker_ranks_start(argv, a.folder, a.n_rank, a.n_thread);
    if (code >= 0) return code;
    reading_note_on_crash(a.check != NULL);
    enter_sandbox(&a, argv, &failed);
    if ((files_only(&a) || is_helper(&a)) && failed.code != STATUS_OK && a.sandbox == CONFINE_REQUIRED) {
        fprintf(stderr, "selvedge-worker: %s\n", failed.text);
        return WORKER_USAGE;
    }
    if (is_helper(&a)) {
        report_sandbox_of_helper(&a, &failed);
        return worker_team_help(&a.team, a.n_thread);
    }
    if (files_only(&a)) return a.plan ? print_plan(&a) : print_check(&a);
    worker_signals_set();
    status s = worker_folder_open(&folder, a.folder, &err);
    if (s == STATUS_OK && a.start != NULL && (s = worker_folder_claim(&folder, a.start, &err)) != STATUS_OK)
        worker_folder_close(&folder);
    if (s != STATUS_OK) {
        fprintf(stderr, "selvedge-worker: %s\n", err.text);
        return s == STATUS_STALE ? WORKER_STALE : s == STATUS_NOT_FOUND ? WORKER_USAGE : WORKER_FAILED;
    }
    worker_folder_sweep(&folder);
    tools =
        (struct stage_tools){.folder = &folder, .memory_limit_bytes = a.memory_mib << 20, .warn = {stage_warn, &tools}};
    worker_folder_path(&folder, a.pictures ? JOB_FILE_PICTURES_LOG : JOB_FILE_LOG, NULL, log_path);
    s = log_open(log_path, a.quiet ? NULL : stderr, LOG_LEVEL_INFO, &tools.log, &err);
    if (s == STATUS_OK)
        s = worker_status_start(&folder, tools.log, a.pictures ? JOB_FILE_PICTURES : JOB_FILE_STATUS, &tools.status,
                                &err);
    if (s != STATUS_OK) {
        fprintf(stderr, "selvedge-worker: %s\n", err.text);
        code = WORKER_FAILED;
    } else {
        s = report_sandbox(&tools, &a, &failed, &err);
        bool lost = false;
        if (s == STATUS_OK) s = run_job(&tools, &a, &lost, &err);
        code = lost ? WORKER_LOST : conclude(tools.status, tools.log, s, &err);
    }
    worker_status_free(tools.status);
    thread_pool_free(tools.pool);
    log_close(tools.log);
    worker_folder_close(&folder);
    return code;
}
