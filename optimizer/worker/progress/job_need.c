#include "optimizer/worker/progress/job_need.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/worker/progress/pipeline_plan.h"
#include "optimizer/worker/progress/plan_probe.h"
#include "optimizer/worker/report/json_number.h"
#include "optimizer/worker/report/result_pictures.h"
#include "optimizer/worker/stages/fit/pipeline_fit_option.h"

#include <math.h>
#include <stdio.h>
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

/* The geometry is that of another job, which this one cannot look at before it runs: neither can its size be known. */
static bool is_adopted(const struct pipeline_context *c) { return c->doc->scan.geometry_job[0] != '\0'; }

/* What the needs of a job go with. */
static void key_of(const struct pipeline_context *c, const char *what, char key[SPEED_BOOK_KEY_BYTES])
{
    const char *cloth = is_adopted(c)                       ? "adopted"
                        : c->doc->scan.given                ? "scan"
                        : c->doc->cloth.description != NULL ? "described"
                                                            : "fibers";
    const char *work = job_document_kind(c->doc) == JOB_OF_PICTURES   ? "+pictures"
                       : job_document_kind(c->doc) == JOB_OF_GEOMETRY ? ""
                       : c->number.n > 0                              ? "+search"
                                                                      : "+fit";
    if (job_document_kind(c->doc) == JOB_OF_PROFILE)
        snprintf(key, SPEED_BOOK_KEY_BYTES, "need.%s.profile", what);
    else
        snprintf(key, SPEED_BOOK_KEY_BYTES, "need.%s.%s%s", what, cloth, work);
}

static void plan_stages(struct pipeline_context *c)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    for (size_t i = 0; i < n_stage; i++)
        if (pipeline_has_stage(c, i)) pipeline_plan_stage(c, info[i].name, i);
}

/* Bytes of the inputs that the document names. */
struct input_bytes {
    const struct pipeline_context *c;
    double all, fibers;
};

static void add_input(void *context, const char *name, const char *role)
{
    struct input_bytes *sum = context;
    char path[WORKER_PATH_BYTES];
    struct stat file;
    (void)role;
    worker_folder_path(sum->c->folder, JOB_FOLDER_INPUT, name, path);
    if (stat(path, &file) != 0) return;
    sum->all += (double)file.st_size;
    if (strcmp(name, sum->c->doc->cloth.fiber_file) == 0) sum->fibers = (double)file.st_size;
}

/* Pages and renderings. */
static double page_bytes(const struct pipeline_context *c)
{
    if (c->fitted.n == 0) return unfitted_bytes;
    const double px = (double)result_picture_px(c, pipeline_plan_usual_paths(c));
    return result_bytes + pixel_bytes * px * px * (double)c->observation.n;
}

/* Memory of the rows of a fiber's profile, and of the largest fit to them. */
static double profile_bytes(const struct pipeline_context *c)
{
    double most = 0.0;
    for (size_t i = 0; i < c->n_model && c->profile.n > 0; i++) {
        struct fit_option option;
        const struct model_info *info = &c->model[i].sets.info;
        pipeline_fit_option(c->model[i].option, info->param, info->n_param, &option);
        most = fmax(most, (double)profile_fit_bytes(&c->profile, info->n_param, profile_fit_starts(&option)));
    }
    return most + (double)(c->profile.n * sizeof *c->profile.row);
}

/* What the models say without corrections. */
static struct job_need model_of(const struct pipeline_context *c)
{
    struct input_bytes input = {.c = c};
    job_document_visit_files(c->doc, add_input, &input);
    const double n_voxel = c->doc->scan.given && !is_adopted(c) ? pipeline_plan_voxels(c) : 0.0;
    double geometry_bytes = voxel_bytes * n_voxel;
    if (c->memory_limit_bytes > 0) geometry_bytes = fmin(geometry_bytes, (double)c->memory_limit_bytes);
    const double size = pipeline_plan_cloth_size(c), n_thread = (double)thread_pool_n_thread(c->pool),
                 thread_s = c->usual_wall_s * n_thread - c->certificate_s * (n_thread - 1.0);
    return (struct job_need){.cpu_s = usual_busy * thread_s,
                             .memory_bytes = program_bytes + geometry_bytes + fiber_file_bytes * input.fibers +
                                             cloth_bytes * size + profile_bytes(c),
                             .disk_bytes = input.all + page_bytes(c) + voxel_result_bytes * n_voxel +
                                           fiber_result_bytes * input.fibers + cloth_result_bytes * size};
}

/* The mean ratio of what jobs of this kind took to what the model said; 1 where none has run. */
static double correction(const struct pipeline_context *c, const struct speed_book *book, const char *what)
{
    char key[SPEED_BOOK_KEY_BYTES];
    key_of(c, what, key);
    const struct speed_entry *e = speed_book_find(book, key);
    return e != NULL ? exp(e->log_s_per_unit) : 1.0;
}

static struct job_need expected(const struct pipeline_context *c, const struct speed_book *book)
{
    struct job_need need = model_of(c);
    need.cpu_s *= correction(c, book, "cpu");
    need.memory_bytes *= correction(c, book, "memory");
    need.disk_bytes *= correction(c, book, "disk");
    return need;
}

static void remember(const struct pipeline_context *c, const char *what, double model, double took,
                     struct speed_book *book)
{
    char key[SPEED_BOOK_KEY_BYTES];
    double even[SPEED_CURVE_POINTS];
    if (!(model > 0.0) || !(took > 0.0)) return;
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) even[k] = (double)(k + 1) / SPEED_CURVE_POINTS;
    key_of(c, what, key);
    speed_book_add(book, key, took, model, even);
}

void job_need_remember(const struct pipeline_context *c, const struct job_need *took, struct speed_book *book)
{
    const struct job_need model = model_of(c);
    remember(c, "cpu", model.cpu_s, took->cpu_s, book);
    remember(c, "memory", model.memory_bytes, took->memory_bytes, book);
    remember(c, "disk", model.disk_bytes, took->disk_bytes, book);
}

void job_need_begin(struct pipeline_context *c)
{
    struct worker_status *shown = c->status, *usual; /* readers of the job's own status would see half a plan */
    struct error unused = {0};
    size_t n[3];
    if (c->doc->scan.n_file > 0 && pipeline_scan_size(c, n, NULL) == STATUS_OK) memcpy(c->geometry.n, n, sizeof n);
    plan_probe_take(c);
    c->usual_wall_s = 0.0;
    if (worker_status_new(c->folder, NULL, &usual, &unused) != STATUS_OK) return;
    c->status = usual;
    plan_stages(c);
    c->usual_wall_s = worker_status_look(usual).eta_s;
    c->status = shown;
    worker_status_free(usual);
}

static json_t *stages_json(struct pipeline_context *c)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    json_t *list = json_array();
    for (size_t i = 0; i < n_stage; i++)
        if (pipeline_has_stage(c, i))
            json_array_append_new(list, json_pack("{s:s, s:o}", "name", info[i].name, "wall_s",
                                                  json_number(worker_status_expected_s(c->status, i))));
    return list;
}

static json_t *needs_json(struct pipeline_context *c, const struct speed_book *book)
{
    job_need_begin(c);
    worker_status_speeds(c->status, book);
    plan_stages(c);
    const struct job_clock_look look = worker_status_look(c->status);
    const struct job_need need = expected(c, book);
    const bool certain = isnan(look.eta_low_s); /* a range that is narrow is not stated by the clock */
    return json_pack("{s:n, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "error", "n_thread",
                     json_count(thread_pool_n_thread(c->pool)), "wall_s", json_number(look.eta_s), "wall_low_s",
                     json_number(certain ? look.eta_s : look.eta_low_s), "wall_high_s",
                     json_number(certain ? look.eta_s : look.eta_high_s), "cpu_s", json_number(need.cpu_s),
                     "memory_bytes", json_number(need.memory_bytes), "disk_bytes", json_number(need.disk_bytes),
                     "stages", stages_json(c));
}

static status read_and_plan(struct pipeline_context *c, const struct speed_book *book, json_t **report,
                            struct error *err)
{
    struct error fault = {0};
    status s = pipeline_read_inputs(c, &fault);
    if (s == STATUS_OK && c->doc->scan.n_file > 0) s = pipeline_scan_size(c, c->geometry.n, &fault);
    *report = s == STATUS_OK ? needs_json(c, book)
                             : json_pack("{s:{s:s, s:s, s:s}}", "error", "code", status_name(s), "field", fault.field,
                                         "text", fault.text);
    return *report != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot plan the job: out of memory");
}

status job_need_report(const char *folder, const struct job_need_machine *machine, json_t **report, struct error *err)
{
    struct worker_folder job = {.lock_fd = -1};
    struct pipeline_context c;
    struct speed_book book = {.n = 0};
    snprintf(job.path, sizeof job.path, "%s", folder);
    if (machine->speeds != NULL) speed_book_read(machine->speeds, &book);
    pipeline_context_init(&c);
    c.folder = &job;
    c.memory_limit_bytes = machine->memory_limit_bytes;
    status s = thread_pool_new(machine->n_thread, &c.pool, err);
    if (s == STATUS_OK) s = worker_status_new(&job, NULL, &c.status, err);
    if (s == STATUS_OK) s = read_and_plan(&c, &book, report, err);
    worker_status_free(c.status);
    pipeline_context_release(&c);
    thread_pool_free(c.pool);
    return s;
}
