#include "optimizer/stages/reading/texture_start.h"

#include "base/catalogue/correction_numbers.h"
#include "base/option_id.h"
#include "optimizer/job/checks/job_document_parts.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SET_WARP, SET_WEFT, N_SET };
static const enum cloth_direction direction_of[N_SET] = {CLOTH_WARP, CLOTH_WEFT};
static const char *const cover_name[N_SET] = {"cover_warp", "cover_weft"};
static const char *const threads_name[N_SET] = {"warp_per_cm", "weft_per_cm"};
static const double LEAST_PER_CM = 1.0, MOST_PER_CM = 400.0; /* as in the option table */

static void note(struct texture_guess *t, const char *name)
{
    if (t->n_taken < TEXTURE_MAX_TAKEN) snprintf(t->taken[t->n_taken++], sizeof *t->taken, "%s", name);
}

/* The number, if the cloth has it at its standard value. */
static struct cloth_number *left_out(struct cloth_description *d, const char *name)
{
    int i = cloth_number_index(d, name);
    return i >= 0 && d->number[i].value == d->number[i].info->standard ? &d->number[i] : NULL;
}

static void take(struct job_cloth *cloth, struct texture_guess *texture, const char *name, double value)
{
    struct cloth_number *n = left_out(cloth->description, name);
    if (n == NULL) return;
    n->value = fmin(fmax(value, n->lower), n->upper);
    note(texture, name);
}

static status take_threads(struct job_cloth *cloth, struct texture_guess *texture, int set, bool *taken,
                           struct error *err)
{
    struct cloth_description *d = cloth->description;
    const struct cloth_number *cover = left_out(d, cover_name[set]);
    double per_cm = 10.0 * cloth->texture_px_per_mm / texture->guess.spacing_px[set];
    if (cover == NULL || cover->fitted) return STATUS_OK; /* given, or replaced by given threads */
    if (!(per_cm >= LEAST_PER_CM && per_cm <= MOST_PER_CM))
        return error_set_field(err, STATUS_INVALID, OPTION_TEXTURE_PX_PER_MM,
                               "at %g pixels in a millimetre, photograph '%.120s' shows %.4g %s yarns in a centimetre: "
                               "cloth has %g to %g",
                               cloth->texture_px_per_mm, cloth->texture, per_cm, set == SET_WARP ? "warp" : "weft",
                               LEAST_PER_CM, MOST_PER_CM);
    d->threads_per_cm[direction_of[set]] = per_cm;
    note(texture, threads_name[set]);
    *taken = true;
    return STATUS_OK;
}

static bool lies_in(const struct cloth_description *d, size_t kind, int set)
{
    enum cloth_direction a = direction_of[set];
    for (size_t i = 0; i < d->n_order[a]; i++)
        if (d->order[a][i] == kind) return true;
    return false;
}

/* Flatness at which the yarns of a kind are as wide as seen, in the mean over warp and weft; NaN for plied yarns, whose
 * width follows from their plies, and for kinds whose distances are not known. */
static double seen_flatness(const struct job_cloth *cloth, const struct texture_guess *texture, size_t kind)
{
    const struct cloth_description *d = cloth->description;
    double radius_um = cloth_number_value(d, NULL, (int)kind, "fiber_radius_um");
    double packing = cloth_number_value(d, NULL, (int)kind, "packing"), sum = 0.0, n = 0.0;
    for (int set = 0; set < N_SET; set++) {
        double per_cm = d->threads_per_cm[direction_of[set]];
        if (!lies_in(d, kind, set) || !(per_cm > 0.0)) continue;
        double round_um = 2.0 * radius_um * sqrt((double)d->kind[kind].n_fiber / packing);
        sum += pow(texture->guess.cover[set] * 1e4 / per_cm / round_um, 2.0);
        n += 1.0;
    }
    return d->kind[kind].n_ply > 1 || n == 0.0 ? NAN : sum / n;
}

static void take_flatness(struct job_cloth *cloth, struct texture_guess *texture)
{
    const struct cloth_description *d = cloth->description;
    for (size_t k = 0; k < d->n_kind; k++) {
        char name[sizeof d->number[0].name];
        double flatness = seen_flatness(cloth, texture, k);
        snprintf(name, sizeof name, "yarns[%zu].flatness", k);
        if (isfinite(flatness)) take(cloth, texture, name, flatness);
    }
}

static status take_scaled(struct job_cloth *cloth, struct texture_guess *texture, struct error *err)
{
    struct cloth_description *d = cloth->description;
    bool taken[N_SET] = {false, false};
    status s = STATUS_OK;
    for (int set = 0; set < N_SET && s == STATUS_OK; set++) s = take_threads(cloth, texture, set, &taken[set], err);
    if (s != STATUS_OK) return s;
    cloth_description_number(d); /* the threads replace the covers */
    if (texture->guess.cover_confidence > TEXTURE_WORTH_TAKING) take_flatness(cloth, texture);
    if (taken[SET_WARP] && taken[SET_WEFT]) { /* the curvature of a wave goes with its height over its length squared */
        double warp = texture->guess.spacing_px[SET_WARP], weft = texture->guess.spacing_px[SET_WEFT];
        take(cloth, texture, "crimp", weft * weft / (warp * warp + weft * weft));
    }
    return STATUS_OK;
}

status texture_take_widths(struct job_cloth *cloth, struct texture_guess *texture, struct error *err)
{
    const struct weave_guess *g = &texture->guess;
    if (cloth->texture_px_per_mm > 0.0 && g->yarns_confidence > TEXTURE_WORTH_TAKING)
        return take_scaled(cloth, texture, err);
    for (int set = 0; set < N_SET && g->cover_confidence > TEXTURE_WORTH_TAKING; set++)
        take(cloth, texture, cover_name[set], g->cover[set]);
    return STATUS_OK;
}

double texture_albedo(double reflectance)
{
    double s = (1.0 - reflectance) / (1.0 + reflectance);
    return 1.0 - s * s;
}

/* Share of the light that the cloth reflects, from the fitted rows that are lit from the front, as if it were a
 * diffuser; NaN without such rows. */
static void reflectance(const struct observation_set *set, double rgb[3])
{
    double sum[3] = {0.0, 0.0, 0.0}, light = 0.0;
    for (size_t i = 0; i < set->n; i++) {
        const struct observation *o = &set->item[i];
        double cosine = cos(o->configuration.light_theta_rad);
        if (o->set != JOB_SET_FIT || !(o->weight > 0.0) || cosine <= 0.0) continue;
        light += cosine;
        for (int k = 0; k < 3; k++) sum[k] += o->mean_rgb[k];
    }
    for (int k = 0; k < 3; k++) rgb[k] = light > 0.0 ? sum[k] / light : NAN;
}

/* Share of the crossings with the warp on top. */
static double warp_share(const struct weave_draft *draft)
{
    double n = 0.0;
    for (size_t i = 0; i < draft->n_warp * draft->n_weft; i++) n += draft->warp_on_top[i] != 0;
    return n / (double)(draft->n_warp * draft->n_weft);
}

/* Albedo of the fibers of a kind in one channel. */
static double seen_albedo(const struct cloth_description *d, const struct weave_guess *g, size_t kind, int channel,
                          double mean_reflectance)
{
    const double seen[N_SET] = {g->warp.rgb[channel], g->weft.rgb[channel]};
    double share = warp_share(&g->draft), mean = share * seen[SET_WARP] + (1.0 - share) * seen[SET_WEFT];
    double sum = 0.0, n = 0.0;
    for (int set = 0; set < N_SET; set++) {
        if (!lies_in(d, kind, set)) continue;
        sum += seen[set];
        n += 1.0;
    }
    if (n == 0.0 || !(mean > 0.0)) return NAN;
    return texture_albedo(fmin(fmax(mean_reflectance * sum / n / mean, 0.0), 1.0));
}

static void start_colors(struct job_inputs *in, size_t i_model, const double mean_rgb[3])
{
    struct model_setup *m = &in->model[i_model];
    const struct job_model *given = &in->section.fit->model[i_model];
    for (size_t p = 0; p < m->sets.info.n_param; p++) {
        const struct param_info *info = &m->sets.info.param[p];
        if (info->channel < 0 || strcmp(param_own_symbol(info), "C_TT") != 0 || m->parameter[p].fixed) continue;
        if (!isnan(given->start[p]) || !isnan(given->option.prior_mean[p]) ||
            job_parameter_is_tied(&given->option, m->sets.info.n_param, p))
            continue;
        double albedo = seen_albedo(in->section.cloth->description, &in->texture.guess, p / m->sets.n_own,
                                    info->channel, mean_rgb[info->channel]);
        if (!isfinite(albedo)) continue;
        m->parameter[p].start = fmin(fmax(albedo, m->parameter[p].lower), m->parameter[p].upper);
        if (i_model == 0) note(&in->texture, info->name);
    }
}

void texture_take_colors(const struct stage_tools *tools, struct job_inputs *in)
{
    double rgb[3];
    if (!in->texture.found || in->texture.contradicts || !in->section.cloth->texture_colors ||
        in->section.cloth->n_group == 0)
        return;
    reflectance(&in->rows.observation, rgb);
    if (!isfinite(rgb[0]) || !(in->texture.guess.color_confidence > TEXTURE_WORTH_TAKING)) {
        char text[300];
        snprintf(text, sizeof text, "the colors of warp and weft are not taken from photograph '%.120s': %s",
                 in->section.cloth->texture,
                 isfinite(rgb[0]) ? "it does not show them clearly" : "no fitted row is lit from the front");
        warning_send(&tools->warn, OPTION_CLOTH_TEXTURE, "%s", text);
        return;
    }
    for (size_t i = 0; i < in->n_model; i++)
        if (in->model[i].sets.n_set > 1) start_colors(in, i, rgb);
}
