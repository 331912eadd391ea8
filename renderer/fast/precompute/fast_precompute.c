#include "renderer/fast/precompute/fast_precompute.h"
#include "base/files/durable.h"
#include "renderer/fast/precompute/precompute_parts.h"
#include "renderer/fast/sphere_harmonics.h"
#include "renderer/scene/scene_place.h"
#include "renderer/scene/scene_ray.h"

#include <string.h>

enum { DEFAULT_ORDER = 4, DEFAULT_PATHS = 50000, DEFAULT_DEEP_EDGE = 12, METHOD_VERSION = 5 };
#define DEFAULT_DEEP_PATHS 8e6

static uint64_t add_bytes(uint64_t h, const void *data, size_t n)
{
    const unsigned char *p = data;
    for (size_t i = 0; i < n; i++) h = (h ^ p[i]) * 0x100000001b3u;
    return h;
}

/* The request with its defaults filled in. */
static struct fast_precompute_request resolved(const struct fast_precompute_request *q)
{
    struct fast_precompute_request r = *q;
    if (r.n_set == 0) r.n_set = 1;
    if (r.order == 0) r.order = DEFAULT_ORDER;
    if (r.n_path == 0) r.n_path = DEFAULT_PATHS;
    if (!(r.cell_paths > 0.0)) r.cell_paths = 2.0;
    if (r.deep_edge == 0) r.deep_edge = DEFAULT_DEEP_EDGE;
    if (!(r.deep_paths > 0.0)) r.deep_paths = DEFAULT_DEEP_PATHS;
    return r;
}

uint64_t fast_tables_checksum(const struct fast_precompute_request *q)
{
    struct fast_precompute_request r = resolved(q);
    const uint32_t number[] = {METHOD_VERSION, (uint32_t)r.n_set, r.order,
                               r.n_path,       r.no_visibility,   scene_has_black_sheet(r.scene),
                               r.deep_traced,  r.deep_edge};
    const double real[] = {r.cell_paths, r.deep_paths};
    uint64_t h = scene_checksum(r.scene, 0xcbf29ce484222325u);
    h = add_bytes(h, r.model->id, strlen(r.model->id));
    h = add_bytes(h, r.param, r.n_set * r.model->n_param * sizeof *r.param);
    h = add_bytes(h, number, sizeof number);
    const struct film_groups *films = scene_films(r.scene);
    h = add_bytes(h, films->material, films->n * sizeof *films->material);
    return add_bytes(h, real, sizeof real);
}

status fast_precompute_kept(const struct fast_precompute_request *q, const char *path, struct fast_tables *t,
                            struct error *err)
{
    status s = fast_tables_read(t, path, err);
    if (s != STATUS_OK || t->checksum == fast_tables_checksum(q)) return s;
    s = error_set(err, STATUS_CONFLICT,
                  "cannot use tables '%s': they were made for another cloth, other scattering parameters or other "
                  "settings (%u segments, %u hits before deep light; wanted: %zu, %u, and the same paths and cells)",
                  path_file_name(path), t->n_segment, t->deep.n_traced, scene_n_segment(q->scene), q->deep_traced);
    fast_tables_release(t);
    return s;
}

static status check(const struct fast_precompute_request *q, struct error *err)
{
    if (q->deep_edge == 1 || q->deep_edge > DEEP_LIGHT_MOST_EDGE)
        return error_set(err, STATUS_INVALID, "cannot make a table of deep light with %u node%s along an edge: 2 to %d",
                         q->deep_edge, q->deep_edge == 1 ? "" : "s", DEEP_LIGHT_MOST_EDGE);
    if (scattering_frame_reason(q->model) != NULL)
        return error_set_field(err, STATUS_INVALID, "model",
                               "cannot render model '%s' by tables: %s, and tables are of fibers that look alike from "
                               "all sides around",
                               q->model->id, scattering_frame_reason(q->model));
    if (scene_is_bent(q->scene)) return error_set(err, STATUS_INVALID, "cannot make tables of a bent cloth");
    if (q->order > SPHERE_MAX_ORDER)
        return error_set(err, STATUS_INVALID, "cannot make tables of order %u: at most %d", q->order, SPHERE_MAX_ORDER);
    return STATUS_OK;
}

static status run_parts(const struct precompute_job *j, const struct progress *progress, struct error *err)
{
    /* rough processor seconds for a twill of 26,000 segments */
    const struct fast_precompute_request *q = j->q;
    const struct {
        status (*run)(struct precompute_job *j, struct error *err);
        double time_s;
    } part[] = {{precompute_scatter, 1.0},
                {precompute_transfer, 5e-4 * q->n_path},
                {precompute_deep, q->deep_traced > 0 ? 12e-6 * q->deep_paths : 0.0},
                {precompute_visibility, q->no_visibility ? 0.0 : 17.0}};
    enum { N_PART = sizeof part / sizeof part[0] };
    double from = 0.0, all_s = 0.0;
    status s = STATUS_OK;
    for (size_t i = 0; i < N_PART; i++) all_s += part[i].time_s;
    for (size_t i = 0; i < N_PART && s == STATUS_OK; i++) {
        struct progress_part of = {progress, from, part[i].time_s / all_s};
        from += of.share;
        struct progress inner = progress_of_part(&of);
        struct precompute_job job = *j;
        job.progress = &inner;
        s = part[i].run(&job, err);
        if (s == STATUS_OK && progress_cancelled(progress)) s = error_set(err, STATUS_CANCELLED, "cancelled");
    }
    return s;
}

status fast_precompute(const struct fast_precompute_request *q, struct thread_pool *pool,
                       const struct progress *progress, struct fast_tables *t, struct error *err)
{
    *t = (struct fast_tables){0};
    status s = check(q, err);
    if (s != STATUS_OK) return s;
    struct fast_precompute_request r = resolved(q);
    struct precompute_journal journal = {0};
    struct precompute_job j = {.q = &r, .pool = pool, .journal = &journal, .t = t};
    t->checksum = fast_tables_checksum(&r);
    t->order = r.order;
    t->n_set = (uint32_t)r.n_set;
    t->mirrored = scene_has_black_sheet(r.scene);
    t->bottom_mm = -scene_thickness_mm(r.scene);
    scene_tile_mm(r.scene, t->tile_mm);
    t->deep = (struct deep_light){.n_traced = r.deep_traced, .edge = r.deep_edge, .n_side = t->mirrored != 0 ? 1 : 2};
    s = parameter_sets_init(&j.sets, r.scene, r.model, r.param, r.n_set, err);
    if (s == STATUS_OK) s = precompute_journal_open(&journal, r.journal_path, r.journal_every_s, t->checksum, err);
    if (s == STATUS_OK) s = run_parts(&j, progress, err);
    precompute_journal_release(&journal);
    parameter_sets_release(&j.sets);
    if (s != STATUS_OK) fast_tables_release(t);
    return s;
}
