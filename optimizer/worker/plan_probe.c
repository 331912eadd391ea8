#include "optimizer/worker/plan_probe.h"
#include "base/clock.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/scene/fiber_file.h"

#include <math.h>
#include <sys/stat.h>

/* The certificate prepares a model at four points for each free parameter (derivative_check.h). */
static const double points_of_parameter = 4.0;
/* Layers of fibers after which a path's time is 63 % of its time in a closed cloth: weaves of straight fibers with
 * areas of 0.8, 2.3, 4.6, 9.2 and 18.4 tiles, whose rows textile.v3 was fitted to, took 0.30, 0.56, 0.84, 0.97 and 1 of
 * it. */
static const double layers = 2.5, least_path_share = 0.1;
/* Bytes of a .hair file for each segment: a position and a diameter. */
static const double bytes_of_segment = 16.0;
/* Larger files have the fibers of a closed cloth, and reading them would take longer than the rest of a plan. */
enum { FIBER_FILE_MOST_BYTES = 4 << 20 };

/* Processor time of preparing a model once; 0 where it cannot be prepared, which the fit reports. */
static double preparation_s(const struct model_setup *m)
{
    double param[MODEL_MAX_PARAM];
    struct scattering_state *surface = NULL;
    struct phase_state *volume = NULL;
    const struct appearance *a = &m->appearance;
    for (size_t p = 0; p < a->n_param; p++) param[p] = m->parameter[p].start;
    const double start_s = clock_thread_s();
    status s =
        a->surface != NULL ? a->surface->prepare(param, &surface, NULL) : a->volume->prepare(param, &volume, NULL);
    const double took_s = clock_thread_s() - start_s;
    if (s == STATUS_OK && surface != NULL) a->surface->release(surface);
    if (s == STATUS_OK && volume != NULL) a->volume->release(volume);
    return s == STATUS_OK ? took_s : 0.0;
}

static double certificate_s(const struct model_setup *m)
{
    const double once_s = preparation_s(m), again_s = preparation_s(m); /* the first may wait for memory */
    size_t n_free = 0;
    for (size_t p = 0; p < m->sets.info.n_param; p++) n_free += !m->parameter[p].fixed;
    return fmin(once_s, again_s) * points_of_parameter * (double)(n_free * m->sets.n_set);
}

double plan_probe_path_share(const struct fiber_set *f)
{
    double area_m2 = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const float *a = &f->position_m[3 * k], *b = a + 3;
            const double length_m = hypot(hypot((double)(b[0] - a[0]), (double)(b[1] - a[1])), (double)(b[2] - a[2]));
            area_m2 += 2.0 * (double)fiber_radius_m(f, i, k) * length_m;
        }
    return fmax(1.0 - exp(-area_m2 / (layers * f->tile_size_m[0] * f->tile_size_m[1])), least_path_share);
}

/* Reads the given file of fibers where it is small: sets path_share and file_segments. */
static void probe_file(struct job_plan *plan)
{
    char path[WORKER_PATH_BYTES];
    struct stat file;
    struct fiber_set f;
    plan->path_share = 1.0;
    plan->file_segments = 0.0;
    if (plan->in->section.cloth->fiber_file[0] == '\0') return;
    worker_folder_path(plan->tools->folder, JOB_FOLDER_INPUT, plan->in->section.cloth->fiber_file, path);
    if (stat(path, &file) != 0) return;
    plan->file_segments = (double)file.st_size / bytes_of_segment;
    if (file.st_size > FIBER_FILE_MOST_BYTES) return;
    fiber_set_init(&f);
    if (fiber_file_read(path, plan->in->section.cloth, &f, NULL) == STATUS_OK)
        plan->path_share = plan_probe_path_share(&f);
    fiber_set_release(&f);
}

void plan_probe_take(struct job_plan *plan)
{
    const bool fits = plan->in->kind == JOB_OF_FIT || plan->in->kind == JOB_OF_PROFILE;
    plan->certificate_s = 0.0;
    for (size_t i = 0; fits && i < plan->in->n_model; i++) {
        plan->model_s[i] = certificate_s(&plan->in->model[i]);
        plan->certificate_s += plan->model_s[i];
    }
    probe_file(plan);
}
