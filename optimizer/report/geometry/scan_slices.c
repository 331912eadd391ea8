#include "optimizer/report/geometry/scan_slices.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "geometry/grade/scan_grade.h"
#include "geometry/volume/slice_tiles.h"
#include "optimizer/job/job_folder.h"

#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *const slice_name[] = {"scan/x.slices", "scan/y.slices", "scan/z.slices"};

static bool missing(const struct report *report, const char *name)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, name, path);
    return access(path, F_OK) != 0;
}

static double megabytes(const struct report *report, const char *name)
{
    char path[WORKER_PATH_BYTES];
    struct stat found;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, name, path);
    return stat(path, &found) == 0 ? 1e-6 * (double)found.st_size : 0.0;
}

static status write_axis(struct report *report, const struct slice_codes *codes, int axis, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    const struct progress silent = progress_silent(&report->in.job->tools->progress);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, slice_name[axis], path);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "scan/.part", temporary);
    status s = slice_tiles_write(codes, axis, report->in.job->tools->pool, &silent, temporary, err);
    if (s == STATUS_OK) s = worker_folder_check(report->in.job->tools->folder, err);
    if (s == STATUS_OK) return durable_rename(temporary, path, err);
    unlink(temporary);
    return s;
}

static status write_slices(struct report *report, struct error *err)
{
    struct slice_codes codes;
    const struct progress silent = progress_silent(&report->in.job->tools->progress);
    double start_s = clock_monotonic_s(), size = 0.0;
    status s = slice_codes_make(&report->volume.volume, &report->in.made->direction, SLICE_MOST_VOXEL,
                                report->in.job->tools->pool, &silent, &codes, err);
    for (int axis = 0; axis < 3 && s == STATUS_OK; axis++) {
        s = write_axis(report, &codes, axis, err);
        size += megabytes(report, slice_name[axis]);
    }
    slice_codes_release(&codes);
    if (s == STATUS_OK)
        log_info(report->in.job->tools->log, "slices for the viewer: %.1f MB, %.1f s", size,
                 clock_monotonic_s() - start_s);
    return s;
}

/* A byte for each point of scan/fibers.hair, in which long fibers have the point between two strands twice. */
static uint8_t *contrast_bytes(const struct fiber_set *f, const float *contrast, size_t *n_byte)
{
    uint8_t *bytes = malloc(f->n_vertex + f->n_vertex / FIBER_HAIR_MAX_SEGMENT + 1);
    *n_byte = 0;
    for (size_t i = 0; i < f->n_fiber && bytes != NULL; i++)
        for (size_t first = f->first_vertex[i], k = first; k < f->first_vertex[i + 1]; k++) {
            uint8_t byte = (uint8_t)lrint(100.0 * fmin(2.55, fmax(0.0, (double)contrast[k])));
            bytes[(*n_byte)++] = byte;
            if (k > first && k + 1 < f->first_vertex[i + 1] && (k - first) % FIBER_HAIR_MAX_SEGMENT == 0)
                bytes[(*n_byte)++] = byte;
        }
    return bytes;
}

static status write_contrast(struct report *report, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    const struct progress silent = progress_silent(&report->in.job->tools->progress);
    float *contrast = malloc((report->in.made->traced.n_vertex + 1) * sizeof *contrast);
    if (contrast == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot grade the fibers: out of memory");
    status s = scan_grade_contrast(&report->volume.volume, &report->in.made->traced, report->in.job->tools->pool,
                                   &silent, contrast, err);
    size_t n_byte = 0;
    uint8_t *bytes = s == STATUS_OK ? contrast_bytes(&report->in.made->traced, contrast, &n_byte) : NULL;
    if (s == STATUS_OK && bytes == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot grade the fibers: out of memory");
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "scan/contrast.u8", path);
    if (s == STATUS_OK) s = worker_folder_check(report->in.job->tools->folder, err);
    if (s == STATUS_OK) s = durable_replace(path, bytes, n_byte, err);
    free(contrast);
    free(bytes);
    return s;
}

static status write_traced(struct report *report, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "scan/fibers.hair", path);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "scan/.part", temporary);
    status s = fiber_set_write_hair(&report->in.made->traced, temporary, err);
    if (s == STATUS_OK) s = worker_folder_check(report->in.job->tools->folder, err);
    if (s == STATUS_OK) return durable_rename(temporary, path, err);
    unlink(temporary);
    return s;
}

status scan_slices_write(struct report *report, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "scan", path);
    status s = durable_make_folder(path, err);
    if (s == STATUS_OK &&
        (missing(report, slice_name[0]) || missing(report, slice_name[1]) || missing(report, slice_name[2])))
        s = write_slices(report, err);
    if (s == STATUS_OK) s = write_traced(report, err);
    if (s == STATUS_OK) s = write_contrast(report, err);
    return s;
}
