#include "optimizer/worker/stages/scene/pipeline_texture.h"

#include "base/option_id.h"
#include "optimizer/fit/photographs/photograph.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/stages/scene/texture_start.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Below this confidence a contradiction is not certain. */
static const double LEAST_CERTAIN = 0.7;
/* Counted threads that differ by more than this share from those of the photograph contradict it. */
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

static void compare_drafts(struct pipeline_context *c)
{
    struct weave_draft own;
    char shown[32], given[32], text[400];
    const bool felt = c->doc->cloth.description->structure == CLOTH_FELT;
    if (!felt && (!draft_of_job(c->doc->cloth.description, &own) || weave_draft_same(&own, &c->texture.guess.draft)))
        return;
    double confidence = c->texture.guess.draft_confidence;
    c->texture.contradicts = true;
    weave_draft_name(&c->texture.guess.draft, shown, sizeof shown);
    if (felt)
        snprintf(given, sizeof given, "%s", c->doc->cloth.description->weave);
    else
        weave_draft_name(&own, given, sizeof given);
    snprintf(text, sizeof text,
             "photograph '%.120s' shows the weave '%s'%s%s (confidence %.2f), and the job says '%s': %s",
             c->doc->cloth.texture, shown, strcmp(shown, given) == 0 ? " in another" : "",
             strcmp(shown, given) == 0 ? " direction or step" : "", confidence, given,
             confidence < LEAST_CERTAIN ? "the photograph is not certain" : "one of them is wrong");
    pipeline_warn(c, OPTION_CLOTH_TEXTURE, text);
}

/* Warns of threads that the job counts otherwise than the photograph shows them at its scale. */
static void compare_threads(struct pipeline_context *c)
{
    static const char *const name[] = {"weft", "warp"};
    const struct cloth_description *d = c->doc->cloth.description;
    char text[400];
    if (!(c->doc->cloth.texture_px_per_mm > 0.0 && c->texture.guess.yarns_confidence > TEXTURE_WORTH_TAKING)) return;
    for (int a = CLOTH_WEFT; a <= CLOTH_WARP; a++) {
        double shown = 10.0 * c->doc->cloth.texture_px_per_mm / c->texture.guess.spacing_px[a == CLOTH_WARP ? 0 : 1];
        if (!(d->threads_per_cm[a] > 0.0) || fabs(log(shown / d->threads_per_cm[a])) < log(1.0 + THREADS_OFF)) continue;
        snprintf(
            text, sizeof text,
            "photograph '%.120s' shows %.3g %s yarns in a centimetre (confidence %.2f), and the job says %.3g: one "
            "of them or the scale of the photograph, %g pixels in a millimetre, is wrong",
            c->doc->cloth.texture, shown, name[a], c->texture.guess.yarns_confidence, d->threads_per_cm[a],
            c->doc->cloth.texture_px_per_mm);
        pipeline_warn(c, OPTION_CLOTH_TEXTURE, text);
    }
}

static void warn_uncertain(struct pipeline_context *c)
{
    char text[300];
    double confidence = c->texture.guess.draft_confidence;
    if (confidence >= LEAST_CERTAIN) return;
    snprintf(text, sizeof text,
             "the draft comes from photograph '%.120s', which is not certain of it (confidence %.2f): compare it with "
             "the cloth, or state 'weave' or 'draft'",
             c->doc->cloth.texture, confidence);
    pipeline_warn(c, OPTION_CLOTH_TEXTURE, text);
}

static status take_draft(struct pipeline_context *c, struct error *err)
{
    const struct weave_guess *g = &c->texture.guess;
    struct cloth_description *d = c->doc->cloth.description;
    char text[WEAVE_CELL_MAX][WEAVE_CELL_MAX + 1] = {{0}};
    const char *row[WEAVE_CELL_MAX];
    for (size_t j = 0; j < g->draft.n_weft; j++) {
        for (size_t i = 0; i < g->draft.n_warp; i++)
            text[j][i] = g->draft.warp_on_top[j * g->draft.n_warp + i] != 0 ? '1' : '0';
        row[j] = text[j];
    }
    status s = cloth_description_draft(d, row, g->draft.n_weft, err);
    for (int a = CLOTH_WEFT; a <= CLOTH_WARP; a++) d->n_yarn[a] = c->doc->cloth.tile_yarn[a];
    if (s == STATUS_OK) s = texture_take_widths(c, err);
    if (s == STATUS_OK) s = cloth_description_check(d, err);
    if (s == STATUS_OK) s = job_cloth_check_final_tiles(&c->doc->cloth, err);
    if (s == STATUS_INVALID) job_cloth_name_field(err);
    return s;
}

static status name_file(struct error *err, status s)
{
    if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_CLOTH_TEXTURE);
    return s;
}

static status detect(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    const struct job_photograph photograph = photograph_plain(JOB_TRANSFER_SRGB);
    struct image im;
    worker_folder_path(c->folder, JOB_FOLDER_INPUT, c->doc->cloth.texture, path);
    status s = photograph_read(path, &photograph, &im, NULL, err);
    if (s != STATUS_OK) return s;
    const struct weave_picture picture = {im.pixel, im.width, im.height};
    s = weave_detect(&picture, &c->texture.guess, err);
    image_release(&im);
    return s;
}

status pipeline_read_texture(struct pipeline_context *c, struct error *err)
{
    char name[32];
    if (c->doc->cloth.description == NULL || c->doc->cloth.texture[0] == '\0') return STATUS_OK;
    status s = detect(c, err);
    if (s == STATUS_NOT_FOUND && c->doc->cloth.draft_from_texture) return name_file(err, err->code = STATUS_INVALID);
    if (s == STATUS_NOT_FOUND) {
        pipeline_warn(c, OPTION_CLOTH_TEXTURE, err->text);
        return STATUS_OK;
    }
    if (s != STATUS_OK) return name_file(err, s);
    const struct weave_guess *g = &c->texture.guess;
    c->texture.found = true;
    weave_draft_name(&g->draft, name, sizeof name);
    log_info(c->log,
             "photograph '%s' shows the weave '%s' (confidence %.2f), warps every %.2f and wefts every %.2f pixels "
             "(confidence %.2f)",
             c->doc->cloth.texture, name, g->draft_confidence, g->spacing_px[0], g->spacing_px[1], g->yarns_confidence);
    compare_threads(c);
    if (c->doc->cloth.draft_from_texture) {
        warn_uncertain(c);
        return take_draft(c, err);
    }
    compare_drafts(c);
    return STATUS_OK;
}
