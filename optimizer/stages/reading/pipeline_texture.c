#include "optimizer/stages/reading/pipeline_texture.h"

#include "base/option_id.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/stages/reading/texture_start.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Below this confidence a contradiction is not certain. */
static const double LEAST_CERTAIN = 0.7;
/* Counted threads that differ by more than this share from the threads of the photograph contradict it. */
static const double THREADS_OFF = 0.1;

/* The job's draft in the order of a detected one: row 0 is the upper weft. The draft of a cloth without one repeat of
 * at most WEAVE_CELL_MAX yarns cannot be compared: false. */
static bool draft_of_job(const struct cloth_description *d, struct weave_draft *draft)
{
    *draft = (struct weave_draft){.n_warp = d->n_warp, .n_weft = d->n_weft};
    if (d->structure != CLOTH_WOVEN || d->n_warp > WEAVE_CELL_MAX || d->n_weft > WEAVE_CELL_MAX) return false;
    for (size_t j = 0; j < d->n_weft; j++)
        for (size_t i = 0; i < d->n_warp; i++)
            draft->warp_on_top[j * d->n_warp + i] = d->warp_over[d->n_weft - 1 - j][i];
    return true;
}

static void compare_drafts(const struct texture_input *in, struct texture_guess *texture)
{
    struct weave_draft own;
    char shown[32], given[32], text[400];
    const bool felt = in->cloth->description->structure == CLOTH_FELT;
    if (!felt && (!draft_of_job(in->cloth->description, &own) || weave_draft_same(&own, &texture->guess.draft))) return;
    double confidence = texture->guess.draft_confidence;
    texture->contradicts = true;
    weave_draft_name(&texture->guess.draft, shown, sizeof shown);
    if (felt)
        snprintf(given, sizeof given, "%s", in->cloth->description->weave);
    else
        weave_draft_name(&own, given, sizeof given);
    snprintf(text, sizeof text,
             "photograph '%.120s' shows the weave '%s'%s%s (confidence %.2f), and the job says '%s': %s",
             in->cloth->texture, shown, strcmp(shown, given) == 0 ? " in another" : "",
             strcmp(shown, given) == 0 ? " direction or step" : "", confidence, given,
             confidence < LEAST_CERTAIN ? "the photograph is not certain" : "one of them is wrong");
    warning_send(&in->tools->warn, OPTION_CLOTH_TEXTURE, "%s", text);
}

/* Warns of threads that the job counts otherwise than the photograph shows them at its scale. */
static void compare_threads(const struct texture_input *in, struct texture_guess *texture)
{
    static const char *const name[] = {"weft", "warp"};
    const struct cloth_description *d = in->cloth->description;
    char text[400];
    if (!(in->cloth->texture_px_per_mm > 0.0 && texture->guess.yarns_confidence > TEXTURE_WORTH_TAKING)) return;
    for (int a = CLOTH_WEFT; a <= CLOTH_WARP; a++) {
        double shown = 10.0 * in->cloth->texture_px_per_mm / texture->guess.spacing_px[a == CLOTH_WARP ? 0 : 1];
        if (!(d->threads_per_cm[a] > 0.0) || fabs(log(shown / d->threads_per_cm[a])) < log(1.0 + THREADS_OFF)) continue;
        snprintf(
            text, sizeof text,
            "photograph '%.120s' shows %.3g %s yarns in a centimetre (confidence %.2f), and the job says %.3g: one "
            "of them or the scale of the photograph, %g pixels in a millimetre, is wrong",
            in->cloth->texture, shown, name[a], texture->guess.yarns_confidence, d->threads_per_cm[a],
            in->cloth->texture_px_per_mm);
        warning_send(&in->tools->warn, OPTION_CLOTH_TEXTURE, "%s", text);
    }
}

static void warn_uncertain(const struct texture_input *in, struct texture_guess *texture)
{
    char text[300];
    double confidence = texture->guess.draft_confidence;
    if (confidence >= LEAST_CERTAIN) return;
    snprintf(text, sizeof text,
             "the draft comes from photograph '%.120s', which is not certain of it (confidence %.2f): compare it with "
             "the cloth, or state 'weave' or 'draft'",
             in->cloth->texture, confidence);
    warning_send(&in->tools->warn, OPTION_CLOTH_TEXTURE, "%s", text);
}

static status take_draft(const struct texture_input *in, struct texture_guess *texture, struct error *err)
{
    const struct weave_guess *g = &texture->guess;
    struct cloth_description *d = in->cloth->description;
    char text[WEAVE_CELL_MAX][WEAVE_CELL_MAX + 1] = {{0}};
    const char *row[WEAVE_CELL_MAX];
    for (size_t j = 0; j < g->draft.n_weft; j++) {
        for (size_t i = 0; i < g->draft.n_warp; i++)
            text[j][i] = g->draft.warp_on_top[j * g->draft.n_warp + i] != 0 ? '1' : '0';
        row[j] = text[j];
    }
    status s = cloth_description_draft(d, row, g->draft.n_weft, err);
    for (int a = CLOTH_WEFT; a <= CLOTH_WARP; a++) d->n_yarn[a] = in->cloth->tile_yarn[a];
    if (s == STATUS_OK) s = texture_take_widths(in->cloth, texture, err);
    if (s == STATUS_OK) s = cloth_description_check(d, err);
    if (s == STATUS_OK) s = job_cloth_check_final_tiles(in->cloth, err);
    if (s == STATUS_INVALID) job_cloth_name_field(err);
    return s;
}

static status name_file(struct error *err, status s)
{
    if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_CLOTH_TEXTURE);
    return s;
}

static status detect(const struct texture_input *in, struct texture_guess *texture, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    const struct job_photograph photograph = photograph_assumed(JOB_TRANSFER_SRGB);
    struct image im;
    worker_folder_path(in->tools->folder, JOB_FOLDER_INPUT, in->cloth->texture, path);
    status s = photograph_read(path, &photograph, &im, NULL, err);
    if (s != STATUS_OK) return s;
    const struct weave_picture picture = {im.pixel, im.width, im.height};
    s = weave_detect(&picture, &texture->guess, err);
    image_release(&im);
    return s;
}

status pipeline_read_texture(const struct texture_input *in, struct texture_guess *texture, struct error *err)
{
    char name[32];
    if (in->cloth->description == NULL || in->cloth->texture[0] == '\0') return STATUS_OK;
    status s = detect(in, texture, err);
    if (s == STATUS_NOT_FOUND && in->cloth->draft_from_texture) return name_file(err, err->code = STATUS_INVALID);
    if (s == STATUS_NOT_FOUND) {
        warning_send(&in->tools->warn, OPTION_CLOTH_TEXTURE, "%s", err->text);
        return STATUS_OK;
    }
    if (s != STATUS_OK) return name_file(err, s);
    const struct weave_guess *g = &texture->guess;
    texture->found = true;
    weave_draft_name(&g->draft, name, sizeof name);
    log_info(in->tools->log,
             "photograph '%s' shows the weave '%s' (confidence %.2f), warps every %.2f and wefts every %.2f pixels "
             "(confidence %.2f)",
             in->cloth->texture, name, g->draft_confidence, g->spacing_px[0], g->spacing_px[1], g->yarns_confidence);
    compare_threads(in, texture);
    if (in->cloth->draft_from_texture) {
        warn_uncertain(in, texture);
        return take_draft(in, texture, err);
    }
    compare_drafts(in, texture);
    return STATUS_OK;
}
