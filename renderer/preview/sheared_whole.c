/* The sheared filter as one sum over four dimensions (equation 5.4). */
#include "renderer/preview/sheared_kernel.h"

struct run {
    const struct light_field *f;
    enum sheared_lamp lamp;
    const struct progress *progress;
    float *visibility;
};

/* Weights of the rays of receiver i along edge a, which lies `offset` receivers from the filtered one. */
static void weigh(const struct run *r, const struct sheared_kernel *k, size_t i, int a, float offset, float *weight)
{
    float across = sheared_weight_x(k, a, offset), centre = -k->shift[a] * offset;
    for (size_t j = 0; j < r->f->n_side; j++)
        weight[j] = across * sheared_weight_y(k, a, sheared_place(r->f, i, a, j) - centre);
}

static float filter_receiver(const struct run *r, long x, long y)
{
    const struct light_field *f = r->f;
    const size_t l = f->n_side, at = (size_t)y * f->width + (size_t)x;
    struct sheared_kernel k;
    double sum = 0.0, all = 0.0;
    if (!sheared_kernel_at(f, r->lamp, at, &k)) return sheared_own(f, at);
    for (long v = y - SHEARED_REACH; v <= y + SHEARED_REACH; v++)
        for (long u = x - SHEARED_REACH; u <= x + SHEARED_REACH; u++) {
            float first[LIGHT_FIELD_MAX_SIDE], second[LIGHT_FIELD_MAX_SIDE];
            if (u < 0 || v < 0 || u >= (long)f->width || v >= (long)f->height) continue;
            size_t i = (size_t)v * f->width + (size_t)u;
            weigh(r, &k, i, 0, (float)(u - x), first);
            weigh(r, &k, i, 1, (float)(v - y), second);
            for (size_t j = 0; j < l * l; j++) {
                double weight = (double)(first[j % l] * second[j / l]);
                all += weight;
                if (f->lit[i * l * l + j]) sum += weight;
            }
        }
    return all > 0.0 ? (float)(sum / all) : sheared_own(f, at);
}

static void run_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    for (size_t x = 0; x < r->f->width && !progress_cancelled(r->progress); x++)
        r->visibility[y * r->f->width + x] = filter_receiver(r, (long)x, (long)y);
}

status sheared_filter_whole(const struct light_field *f, enum sheared_lamp lamp, struct thread_pool *pool,
                            const struct progress *progress, float *visibility, struct error *err)
{
    struct run r = {f, lamp, progress, visibility};
    status s = thread_pool_run(pool, f->height, run_row, &r, progress);
    if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
    return s == STATUS_OK ? s : error_set(err, s, "filtering a shadow was cancelled");
}
