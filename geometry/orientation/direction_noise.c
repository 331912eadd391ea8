#include "geometry/orientation/direction_noise.h"
#include "base/angle.h"

#include <math.h>
#include <stdlib.h>

struct noise_job {
    const struct direction_volume *d;
    double *sum; /* two numbers per slice: sum of angles, number of pairs */
};

static void noise_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct noise_job *job = context;
    const struct direction_volume *v = job->d;
    const size_t *n = v->n, stride[3] = {1, n[0], n[0] * n[1]};
    double sum = 0.0, count = 0.0;
    scratch_keep_within(v->space);
    for (size_t j = 0; j < n[1]; j++)
        for (size_t i = 0; i < n[0]; i++) {
            size_t at = volume_index(n, i, j, k), x[3] = {i, j, k};
            float d[3], e[3];
            if (v->density[at] == 0) continue;
            direction_volume_get(v, at, d);
            float size[3] = {fabsf(d[0]), fabsf(d[1]), fabsf(d[2])};
            int axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
            if (x[axis] + 1 >= n[axis] || v->density[at + stride[axis]] == 0) continue;
            direction_volume_get(v, at + stride[axis], e);
            sum += acos(fmin(1.0, fabs((double)(d[0] * e[0] + d[1] * e[1] + d[2] * e[2]))));
            count += 1.0;
        }
    job->sum[2 * k] = sum;
    job->sum[2 * k + 1] = count;
}

status direction_noise_measure(const struct direction_volume *d, struct thread_pool *pool,
                               const struct progress *progress, double *mean_deg, struct error *err)
{
    struct noise_job job = {.d = d, .sum = malloc(2 * d->n[2] * sizeof(double))};
    double sum = 0.0, count = 0.0;
    if (job.sum == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot measure the noise of directions: out of memory");
    status s = thread_pool_run(pool, d->n[2], noise_slice, &job, progress);
    for (size_t k = 0; k < d->n[2] && s == STATUS_OK; k++) {
        sum += job.sum[2 * k];
        count += job.sum[2 * k + 1];
    }
    *mean_deg = count > 0.0 ? angle_to_deg(sum / count) : NAN;
    free(job.sum);
    return s == STATUS_OK ? s : error_set(err, s, "measuring the noise of directions was cancelled");
}
