#include "optimizer/photographs/camera/noise_calibrate.h"

#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/photographs/reader/photograph_reader.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LIMIT_PIXEL = 200 * 1000 * 1000, BLOCK_PX = 16, MAX_FRAME = 256 };

struct frame {
    const char *path;
    struct image image; /* DN above black */
    double exposure_s, iso, limit_dn;
    char camera[96];
};

/* Mean and variance of a channel by two frames of one exposure time, or by a single frame. */
struct dark_point {
    double t_s, mean[3], var[3]; /* var NaN: of a single frame */
};

static status read_frame(const char *path, const struct noise_frames *f, struct frame *out, struct error *err)
{
    const struct photograph_request q = {.transfer = f->transfer, .black_level = NAN, .limit_pixel = LIMIT_PIXEL};
    struct photograph_info info;
    *out = (struct frame){.path = path};
    status s = photograph_file_read(path, &q, &out->image, &info, err);
    if (s != STATUS_OK) return s;
    out->exposure_s = isnan(info.exposure_s) ? f->exposure_s : info.exposure_s;
    out->iso = info.iso;
    out->limit_dn = info.full_scale * photograph_saturation(&info);
    snprintf(out->camera, sizeof out->camera, "%s", info.camera);
    for (size_t i = 0; i < out->image.width * out->image.height * 3; i++) out->image.pixel[i] *= (float)info.full_scale;
    if (isnan(out->exposure_s))
        s = error_set(
            err, STATUS_INVALID,
            "cannot use frame '%s': its exposure time is not known: give raw files, or the time of all frames "
            "(--exposure-s)",
            path_file_name(path));
    if (s != STATUS_OK) image_release(&out->image);
    return s;
}

/* Checks that two frames may be compared: the same camera, ISO and size. */
static status check_alike(const struct frame *a, const struct frame *b, struct error *err)
{
    const char *what = a->image.width != b->image.width || a->image.height != b->image.height ? "sizes"
                       : strcmp(a->camera, b->camera) != 0                                    ? "cameras"
                       : a->iso != b->iso && !(isnan(a->iso) && isnan(b->iso))                ? "ISO values"
                                                                                              : NULL;
    if (what == NULL) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "cannot use frames '%s' and '%s' together: they have different %s",
                     path_file_name(a->path), path_file_name(b->path), what);
}

static bool same_time(const struct frame *a, const struct frame *b)
{
    return fabs(a->exposure_s - b->exposure_s) <= 1e-3 * a->exposure_s;
}

static double mean_of(const struct frame *a, size_t c)
{
    size_t n = a->image.width * a->image.height;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += (double)a->image.pixel[3 * i + c];
    return sum / (double)n;
}

static struct dark_point dark_single(const struct frame *a)
{
    struct dark_point p = {.t_s = a->exposure_s, .var = {NAN, NAN, NAN}};
    for (size_t c = 0; c < 3; c++) p.mean[c] = mean_of(a, c);
    return p;
}

static struct dark_point dark_pair(const struct frame *a, const struct frame *b)
{
    struct dark_point p = {.t_s = a->exposure_s};
    size_t n = a->image.width * a->image.height;
    for (size_t c = 0; c < 3; c++) {
        double mean[2] = {mean_of(a, c), mean_of(b, c)}, sum = 0.0;
        for (size_t i = 0; i < n; i++) {
            double d = (double)a->image.pixel[3 * i + c] - mean[0] - ((double)b->image.pixel[3 * i + c] - mean[1]);
            sum += d * d;
        }
        p.mean[c] = 0.5 * (mean[0] + mean[1]);
        p.var[c] = sum / (double)(n - 1) / 2.0;
    }
    return p;
}

/* Least-squares line through n points; a slope of 0 where all have one t. */
static void fit_line(size_t n, const double *t, const double *y, double *at_zero, double *slope)
{
    double mt = 0.0, my = 0.0, tt = 0.0, ty = 0.0;
    for (size_t i = 0; i < n; i++) {
        mt += t[i] / (double)n;
        my += y[i] / (double)n;
    }
    for (size_t i = 0; i < n; i++) {
        tt += (t[i] - mt) * (t[i] - mt);
        ty += (t[i] - mt) * (y[i] - my);
    }
    *slope = tt > 1e-6 * mt * mt ? ty / tt : 0.0;
    *at_zero = my - *slope * mt;
}

static void fit_dark(const struct dark_point *p, size_t n, size_t c, struct noise_channel *k)
{
    double t[MAX_FRAME], mean[MAX_FRAME], t_var[MAX_FRAME], var[MAX_FRAME];
    size_t n_var = 0;
    for (size_t i = 0; i < n; i++) {
        t[i] = p[i].t_s;
        mean[i] = p[i].mean[c];
        if (isnan(p[i].var[c])) continue;
        t_var[n_var] = p[i].t_s;
        var[n_var++] = p[i].var[c];
    }
    fit_line(n, t, mean, &k->read_mean, &k->dark_mean);
    fit_line(n_var, t_var, var, &k->read_var, &k->dark_var);
    if (k->dark_var < 0.0) { /* a line without slope */
        k->read_var = k->dark_var = 0.0;
        for (size_t i = 0; i < n_var; i++) k->read_var += var[i] / (double)n_var;
    }
    k->read_var = fmax(k->read_var, 0.0);
}

/* Adds the two sums of a block whose quotient is s_s^2. A block with a saturated pixel adds nothing. */
static void add_block(const struct frame *a, const struct frame *b, size_t x0, size_t y0, struct noise_record *r,
                      double var[3], double light[3])
{
    const double n = BLOCK_PX * BLOCK_PX;
    for (size_t c = 0; c < 3; c++) {
        double sum = 0.0, sum2 = 0.0, mean = 0.0;
        for (size_t y = y0; y < y0 + BLOCK_PX; y++)
            for (size_t x = x0; x < x0 + BLOCK_PX; x++) {
                size_t i = 3 * (y * a->image.width + x) + c;
                double va = (double)a->image.pixel[i], vb = (double)b->image.pixel[i];
                if (va >= a->limit_dn || vb >= b->limit_dn) return;
                sum += va - vb;
                sum2 += (va - vb) * (va - vb);
                mean += 0.5 * (va + vb) / n;
            }
        const struct noise_channel *k = &r->channel[c];
        var[c] += (sum2 - sum * sum / n) / (n - 1.0) / 2.0 - k->read_var - k->dark_var * a->exposure_s;
        light[c] += mean - k->read_mean - k->dark_mean * a->exposure_s;
    }
}

static void add_flat_pair(const struct frame *a, const struct frame *b, struct noise_record *r, double var[3],
                          double light[3])
{
    for (size_t y = 0; y + BLOCK_PX <= a->image.height; y += BLOCK_PX)
        for (size_t x = 0; x + BLOCK_PX <= a->image.width; x += BLOCK_PX) add_block(a, b, x, y, r, var, light);
}

/* Frames are read in order. Two neighbours of one exposure time are a pair, and a frame belongs to one pair. */
struct frame_walk {
    const struct noise_frames *frames;
    struct noise_record *record;
    struct dark_point *dark;
    size_t n_dark_point, n_pair;
    double var[3], light[3];
    struct frame first; /* of all frames, without its pixels: the others are compared with it */
};

static status walk_dark(struct frame_walk *w, struct error *err)
{
    struct frame before = {0}, now;
    status s = STATUS_OK;
    for (size_t i = 0; i < w->frames->n_dark && s == STATUS_OK; i++) {
        s = read_frame(w->frames->dark[i], w->frames, &now, err);
        if (s != STATUS_OK) break;
        if (i == 0) w->first = now;
        s = check_alike(&w->first, &now, err);
        bool paired = before.image.pixel != NULL && same_time(&before, &now);
        if (s == STATUS_OK && paired) {
            w->dark[w->n_dark_point++] = dark_pair(&before, &now);
            w->n_pair++;
        } else if (s == STATUS_OK && before.image.pixel != NULL) {
            w->dark[w->n_dark_point++] = dark_single(&before);
        }
        image_release(&before.image);
        before = now;
        if (paired) {
            image_release(&before.image);
            before = (struct frame){0};
        }
    }
    if (s == STATUS_OK && before.image.pixel != NULL) w->dark[w->n_dark_point++] = dark_single(&before);
    image_release(&before.image);
    if (s == STATUS_OK && w->n_pair == 0)
        s = error_set(err, STATUS_INVALID,
                      "cannot measure the camera's noise: no two dark frames in a row have the same exposure time");
    return s;
}

static status walk_flat(struct frame_walk *w, struct error *err)
{
    status s = STATUS_OK;
    size_t n_pair = 0;
    for (size_t i = 0; i + 1 < w->frames->n_flat && s == STATUS_OK; i++) {
        struct frame a = {0}, b = {0};
        s = read_frame(w->frames->flat[i], w->frames, &a, err);
        if (s == STATUS_OK) s = read_frame(w->frames->flat[i + 1], w->frames, &b, err);
        if (s == STATUS_OK) s = check_alike(&w->first, &a, err);
        if (s == STATUS_OK) s = check_alike(&w->first, &b, err);
        if (s == STATUS_OK && same_time(&a, &b)) {
            add_flat_pair(&a, &b, w->record, w->var, w->light);
            n_pair++;
            i++; /* a frame belongs to one pair, so that the pairs are independent */
        }
        image_release(&a.image);
        image_release(&b.image);
    }
    if (s == STATUS_OK && n_pair == 0)
        s = error_set(err, STATUS_INVALID,
                      "cannot measure the camera's noise: no two flat frames in a row have the same exposure time");
    return s;
}

static status finish(struct frame_walk *w, const struct warning_sink *warn, struct error *err)
{
    struct noise_record *r = w->record;
    for (size_t c = 0; c < 3; c++) {
        if (!(w->light[c] > 0.0))
            return error_set(
                err, STATUS_INVALID,
                "cannot measure the camera's noise: the flat frames are saturated, or no brighter than the "
                "dark frames");
        r->channel[c].shot_var = w->var[c] / w->light[c];
        if (r->channel[c].shot_var > 0.0) continue;
        r->channel[c].shot_var = 0.0;
        warning_send(warn, OPTION_NONE, "no shot noise was found in channel %zu: are the flat frames real exposures?",
                     c);
    }
    double least = INFINITY, most = 0.0;
    for (size_t i = 0; i < w->n_dark_point; i++) {
        least = fmin(least, w->dark[i].t_s);
        most = fmax(most, w->dark[i].t_s);
    }
    if (most < 1.01 * least)
        warning_send(
            warn, OPTION_NONE,
            "all dark frames have one exposure time (%g s): dark current counts as read noise, which holds for "
            "exposures near it",
            most);
    return STATUS_OK;
}

status noise_calibrate(const struct noise_frames *f, const struct warning_sink *warn, struct noise_record *r,
                       struct error *err)
{
    struct dark_point dark[MAX_FRAME];
    struct frame_walk w = {.frames = f, .record = r, .dark = dark};
    *r = (struct noise_record){.iso = NAN, .n_dark = f->n_dark, .n_flat = f->n_flat};
    if (f->n_dark < 2 || f->n_flat < 2 || f->n_dark > MAX_FRAME || f->n_flat > MAX_FRAME)
        return error_set(err, STATUS_INVALID,
                         "cannot measure the camera's noise: give 2 to %d dark frames and 2 to %d flat frames",
                         MAX_FRAME, MAX_FRAME);
    status s = walk_dark(&w, err);
    for (size_t c = 0; c < 3 && s == STATUS_OK; c++) fit_dark(dark, w.n_dark_point, c, &r->channel[c]);
    if (s == STATUS_OK) s = walk_flat(&w, err);
    if (s == STATUS_OK) s = finish(&w, warn, err);
    r->iso = w.first.iso;
    snprintf(r->camera, sizeof r->camera, "%s", w.first.camera);
    return s;
}
