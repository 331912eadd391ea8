#include "optimizer/worker/job_need.h"
#include "base/clock.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/report/result/result_pictures.h"
#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/stages/scene/pipeline_volume.h"
#include "optimizer/worker/pipeline_plan.h"
#include "optimizer/worker/plan_probe.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Share of the threads' time that a job computes in: the rest is read, written and waited for. */
static const double usual_busy = 0.85;
/* Resident memory of the program with its libraries; of a voxel of a scan, up to the limit of the geometry stages; of
 * a byte of a file of fibers, whose segments are traced; of a described cloth, by its size (pipeline_plan_cloth_size).
 * Measured on scans of 2 and 17 million voxels (78 and 357 MB), a file of fibers of 0.3 MB (33 MB), and weaves and
 * felts of sizes from 8,000 to 518,000 (33 to 214 MB). */
static const double program_bytes = 31e6, voxel_bytes = 19.0, fiber_file_bytes = 10.0, cloth_bytes = 355.0;
/* Disk of results: pages, and the journal of a fit; of a pixel of a rendering; both together of a job without a fit; of
 * a voxel of a scan, whose density, directions and checkpoints are kept; of a byte of a file of fibers; of a described
 * cloth. Measured on the same jobs (51, 405, 6, and 3 to 94 MB in all), and with renderings of 8 and of 94 pixels (0.9
 * and 2.6 MB). */
static const double result_bytes = 1e6, pixel_bytes = 28.0, unfitted_bytes = 3e6, voxel_result_bytes = 22.0,
                    fiber_result_bytes = 1.5, cloth_result_bytes = 180.0;

/* Returns whether the job takes its geometry from another job. The worker cannot read that job before this one runs, so
 * the size of the geometry is unknown. */
static bool is_adopted(const struct job_plan *plan) { return plan->in->section.scan->geometry_job[0] != '\0'; }

/* Writes the key under which jobs of this kind remember a need. */
static void key_of(const struct job_plan *plan, const char *what, char key[SPEED_BOOK_KEY_BYTES])
{
    const char *cloth = is_adopted(plan)                               ? "adopted"
                        : plan->in->section.scan->given                ? "scan"
                        : plan->in->section.cloth->description != NULL ? "described"
                                                                       : "fibers";
    const char *work = plan->in->kind == JOB_OF_PICTURES   ? "+pictures"
                       : plan->in->kind == JOB_OF_GEOMETRY ? ""
                       : plan->in->number.n > 0            ? "+search"
                                                           : "+fit";
    if (plan->in->kind == JOB_OF_PROFILE)
        snprintf(key, SPEED_BOOK_KEY_BYTES, "need.%s.profile", what);
    else
        snprintf(key, SPEED_BOOK_KEY_BYTES, "need.%s.%s%s", what, cloth, work);
}

static void plan_stages(struct job_plan *plan)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    for (size_t i = 0; i < n_stage; i++)
        if (pipeline_stage_applies(&info[i], plan->in->kind, plan->in->section.scan->given))
            pipeline_plan_stage(plan, info[i].name, i);
}

/* Bytes of the inputs that the document names. */
struct input_bytes {
    const struct job_plan *plan;
    double all, fibers;
};

static void add_input(void *context, const char *name, const char *role)
{
    struct input_bytes *sum = context;
    char path[WORKER_PATH_BYTES];
    struct stat file;
    (void)role;
    worker_folder_path(sum->plan->tools->folder, JOB_FOLDER_INPUT, name, path);
    if (stat(path, &file) != 0) return;
    sum->all += (double)file.st_size;
    if (strcmp(name, sum->plan->in->section.cloth->fiber_file) == 0) sum->fibers = (double)file.st_size;
}

/* Pages and renderings. */
static double page_bytes(const struct job_plan *plan)
{
    if (plan->in->rows.fitted.n == 0) return unfitted_bytes;
    const double px = (double)result_picture_px(plan->in->section.results, plan->in->rows.observation.n,
                                                pipeline_plan_usual_paths(plan));
    return result_bytes + pixel_bytes * px * px * (double)plan->in->rows.observation.n;
}

/* Memory of the rows of a fiber's profile, and of the largest fit to them. */
static double profile_bytes(const struct job_plan *plan)
{
    double most = 0.0;
    for (size_t i = 0; i < plan->in->n_model && plan->in->fiber.profile.n > 0; i++) {
        struct fit_option option;
        const struct model_info *info = &plan->in->model[i].sets.info;
        pipeline_fit_option(plan->in->model[i].option, info->param, info->n_param, &option);
        most =
            fmax(most, (double)profile_fit_bytes(&plan->in->fiber.profile, info->n_param, profile_fit_starts(&option)));
    }
    return most + (double)(plan->in->fiber.profile.n * sizeof *plan->in->fiber.profile.row);
}

/* Returns the needs by the cost models, without corrections. */
static struct job_need model_of(const struct job_plan *plan)
{
    struct input_bytes input = {.plan = plan};
    job_sections_visit_files(&plan->in->section, add_input, &input);
    const double n_voxel = plan->in->section.scan->given && !is_adopted(plan) ? pipeline_plan_voxels(plan) : 0.0;
    double geometry_bytes = voxel_bytes * n_voxel;
    if (plan->tools->memory_limit_bytes > 0)
        geometry_bytes = fmin(geometry_bytes, (double)plan->tools->memory_limit_bytes);
    const double size = pipeline_plan_cloth_size(plan), n_thread = (double)thread_pool_n_thread(plan->tools->pool),
                 alone_s = plan->in->kind == JOB_OF_FIT ? plan->certificate_s : 0.0,
                 thread_s = plan->usual_wall_s * n_thread - alone_s * (n_thread - 1.0);
    return (struct job_need){.cpu_s = usual_busy * thread_s,
                             .memory_bytes = program_bytes + geometry_bytes + fiber_file_bytes * input.fibers +
                                             cloth_bytes * size + profile_bytes(plan),
                             .disk_bytes = input.all + page_bytes(plan) + voxel_result_bytes * n_voxel +
                                           fiber_result_bytes * input.fibers + cloth_result_bytes * size};
}

/* Returns the mean ratio of the needs of earlier jobs of this kind to their model's prediction; 1 where none has
 * run. */
static double correction(const struct job_plan *plan, const struct speed_book *book, const char *what)
{
    char key[SPEED_BOOK_KEY_BYTES];
    key_of(plan, what, key);
    const struct speed_entry *e = speed_book_find(book, key);
    return e != NULL ? exp(e->log_s_per_unit) : 1.0;
}

static struct job_need expected(const struct job_plan *plan, const struct speed_book *book)
{
    struct job_need need = model_of(plan);
    need.cpu_s *= correction(plan, book, "cpu");
    need.memory_bytes *= correction(plan, book, "memory");
    need.disk_bytes *= correction(plan, book, "disk");
    return need;
}

static void remember(const struct job_plan *plan, const char *what, double model, double took, struct speed_book *book)
{
    char key[SPEED_BOOK_KEY_BYTES];
    double even[SPEED_CURVE_POINTS];
    if (!(model > 0.0) || !(took > 0.0)) return;
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) even[k] = (double)(k + 1) / SPEED_CURVE_POINTS;
    key_of(plan, what, key);
    speed_book_add(book, key, took, model, even);
}

void job_need_remember(const struct job_plan *plan, const struct job_need *took, struct speed_book *book)
{
    const struct job_need model = model_of(plan);
    remember(plan, "cpu", model.cpu_s, took->cpu_s, book);
    remember(plan, "memory", model.memory_bytes, took->memory_bytes, book);
    remember(plan, "disk", model.disk_bytes, took->disk_bytes, book);
}

void job_need_begin(struct job_plan *plan)
{
    struct worker_status *shown = plan->status, *usual; /* readers of the job's own status would see half a plan */
    struct error unused = {0};
    size_t n[3];
    if (plan->in->section.scan->n_file > 0 &&
        scan_size(plan->tools->folder, plan->in->section.scan, n, NULL) == STATUS_OK)
        memcpy(plan->geometry.n, n, sizeof n);
    plan_probe_take(plan);
    plan->usual_wall_s = 0.0;
    if (worker_status_new(plan->tools->folder, NULL, &usual, &unused) != STATUS_OK) return;
    plan->status = usual;
    plan_stages(plan);
    plan->usual_wall_s = worker_status_look(usual).eta_s;
    plan->status = shown;
    worker_status_free(usual);
}

static json_t *stages_json(struct job_plan *plan)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    json_t *list = json_pack("[{s:s, s:o}]", "name", "inputs", "wall_s", json_number(plan->inputs_s));
    for (size_t i = 0; i < n_stage; i++)
        if (pipeline_stage_applies(&info[i], plan->in->kind, plan->in->section.scan->given))
            json_array_append_new(list, json_pack("{s:s, s:o}", "name", info[i].name, "wall_s",
                                                  json_number(worker_status_expected_s(plan->status, i))));
    return list;
}

static json_t *needs_json(struct job_plan *plan, const struct speed_book *book)
{
    job_need_begin(plan);
    worker_status_speeds(plan->status, book);
    plan_stages(plan);
    const struct job_clock_look look = worker_status_look(plan->status);
    const struct job_need need = expected(plan, book);
    const double least_s = plan->inputs_s + look.eta_s * exp(-look.spread),
                 most_s = plan->inputs_s + look.eta_s * exp(look.spread);
    return json_pack("{s:n, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "error", "n_thread",
                     json_count(thread_pool_n_thread(plan->tools->pool)), "wall_s",
                     json_number(plan->inputs_s + look.eta_s), "wall_low_s", json_number(least_s), "wall_high_s",
                     json_number(most_s), "cpu_s", json_number(need.cpu_s), "memory_bytes",
                     json_number(need.memory_bytes), "disk_bytes", json_number(need.disk_bytes), "stages",
                     stages_json(plan));
}

static status read_and_plan(struct stage_tools *tools, struct job_inputs *in, const struct speed_book *book,
                            json_t **report, struct error *err)
{
    struct error fault = {0};
    struct job_plan plan;
    size_t n[3] = {0, 0, 0};
    const double from_s = clock_monotonic_s();
    status s = job_inputs_read(tools, in, &fault);
    job_plan_init(&plan, tools, in);
    plan.inputs_s = clock_monotonic_s() - from_s;
    if (s == STATUS_OK && in->section.scan->n_file > 0) s = scan_size(tools->folder, in->section.scan, n, &fault);
    memcpy(plan.geometry.n, n, sizeof n);
    *report = s == STATUS_OK ? needs_json(&plan, book)
                             : json_pack("{s:{s:s, s:s, s:s}}", "error", "code", status_name(s), "field", fault.field,
                                         "text", fault.text);
    return *report != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot plan the job: out of memory");
}

status job_need_report(const char *folder, const struct job_need_machine *machine, json_t **report, struct error *err)
{
    struct worker_folder job = {.lock_fd = -1};
    struct stage_tools tools = {.folder = &job, .memory_limit_bytes = machine->memory_limit_bytes};
    struct job_inputs *in = malloc(sizeof *in);
    struct speed_book book = {.n = 0};
    if (in == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot plan the job: out of memory");
    snprintf(job.path, sizeof job.path, "%s", folder);
    if (machine->speeds != NULL) speed_book_read(machine->speeds, &book);
    job_inputs_init(in);
    tools.warn = (struct warning_sink){stage_warn, &tools};
    status s = thread_pool_new(machine->n_thread, &tools.pool, err);
    if (s == STATUS_OK) s = worker_status_new(&job, NULL, &tools.status, err);
    if (s == STATUS_OK) s = read_and_plan(&tools, in, &book, report, err);
    worker_status_free(tools.status);
    job_inputs_release(in);
    thread_pool_free(tools.pool);
    free(in);
    return s;
}
