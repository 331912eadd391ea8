/* The command "detect". */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/report/geometry/weave_json.h"
#include "optimizer/tools/phantom/phantom_commands.h"
#include "optimizer/tools/phantom/weave_overlay.h"

#include <stdio.h>
#include <string.h>

static const char usage[] =
    "selvedge-phantom detect --photograph FILE [options]\n"
    "\n"
    "Prints what photographs of flat cloth tell about its weave, as JSON: directions and distances of the yarns, the "
    "draft,\n"
    "the width of the yarns over their distance, colors of warp and weft, and confidences from 0 to 1. \"cloth\" holds "
    "what\n"
    "the section \"cloth\" of a job document takes. docs/weave-detection.md describes all members.\n"
    "\n"
    "  --photograph FILE       .png or .exr; repeat it for up to 16 photographs of the same cloth\n"
    "  --px-per-mm N           pixels of the first photograph in a millimetre of cloth             [unknown]\n"
    "  --linear                a PNG holds linear values, not sRGB\n"
    "  --overlay FILE.png      draw the weave over the middle of the most certain photograph\n"
    "\n"
    "Exit codes: 0 done, 1 failed or no weave found in any photograph, 2 wrong arguments.\n";

enum { MAX_PHOTOGRAPH = 16 };

struct detect_option {
    const char *file[MAX_PHOTOGRAPH], *overlay;
    size_t n_file;
    double px_per_mm;
    bool srgb;
};

struct photograph_guess {
    struct image image;
    struct weave_guess guess;
    bool found;
};

static status keep_file(void *to, const char *value, struct error *err)
{
    struct detect_option *o = to;
    if (o->n_file == MAX_PHOTOGRAPH) return error_set(err, STATUS_INVALID, "more than %d photographs", MAX_PHOTOGRAPH);
    o->file[o->n_file++] = value;
    return STATUS_OK;
}

static status parse(int argc, char **argv, struct detect_option *o, struct error *err)
{
    *o = (struct detect_option){.srgb = true};
    const struct command_option option[] = {
        {.name = "photograph", .kind = OPTION_CALL, .to = o, .call = keep_file},
        {.name = "px-per-mm", .kind = OPTION_NUMBER, .to = &o->px_per_mm},
        {.name = "linear", .kind = OPTION_FALSE, .to = &o->srgb},
        {.name = "overlay", .kind = OPTION_TEXT, .to = &o->overlay},
    };
    status s = command_options_parse(argc, argv, option, sizeof option / sizeof *option, err);
    if (s != STATUS_OK) return s;
    if (o->n_file == 0) return error_set(err, STATUS_INVALID, "--photograph is needed");
    if (o->px_per_mm < 0.0) return error_set(err, STATUS_INVALID, "--px-per-mm must be positive");
    return STATUS_OK;
}

/* A photograph without a weave is part of the answer: its sentence goes into the JSON. */
static status detect_one(const struct detect_option *o, size_t i, struct photograph_guess *g, json_t *list,
                         struct error *err)
{
    const struct job_photograph photograph =
        o->srgb ? photograph_plain(JOB_TRANSFER_SRGB) : photograph_assumed(JOB_TRANSFER_LINEAR);
    status s = photograph_read(o->file[i], &photograph, &g->image, NULL, err);
    if (s != STATUS_OK) return s;
    const struct weave_picture picture = {g->image.pixel, g->image.width, g->image.height};
    s = weave_detect(&picture, &g->guess, err);
    if (s != STATUS_OK && s != STATUS_NOT_FOUND) return error_prefix(err, s, "photograph '%s'", o->file[i]);
    g->found = s == STATUS_OK;
    json_t *j = g->found ? weave_guess_json(&g->guess, i == 0 ? o->px_per_mm : 0.0) : json_object();
    if (!g->found) json_object_set_new(j, "error", json_string(err->text));
    json_object_set_new(j, "photograph", json_string(o->file[i]));
    json_array_append_new(list, j);
    return STATUS_OK;
}

/* The entries that a job document may take over. The first photograph gives the scale. */
static json_t *cloth_json(const struct weave_guess *g, double px_per_mm)
{
    json_t *j = json_pack("{s:o}", "draft", weave_draft_json(&g->draft));
    if (px_per_mm > 0.0) {
        json_object_set_new(j, "warp_per_cm", json_real(10.0 * px_per_mm / g->spacing_px[0]));
        json_object_set_new(j, "weft_per_cm", json_real(10.0 * px_per_mm / g->spacing_px[1]));
    } else if (g->cover_confidence > 0.3) {
        json_object_set_new(j, "cover_warp", json_real(g->cover[0]));
        json_object_set_new(j, "cover_weft", json_real(g->cover[1]));
    }
    return j;
}

static status print_answer(const struct detect_option *o, const struct photograph_guess *g, json_t *list,
                           struct error *err)
{
    size_t best = o->n_file;
    bool agree = true;
    for (size_t i = 0; i < o->n_file; i++)
        if (g[i].found && (best == o->n_file || g[i].guess.draft_confidence > g[best].guess.draft_confidence)) best = i;
    json_t *answer = json_pack("{s:O}", "photographs", list);
    if (best < o->n_file) {
        const struct weave_guess *b = &g[best].guess;
        for (size_t i = 0; i < o->n_file; i++)
            agree = agree && (!g[i].found || weave_draft_same(&g[i].guess.draft, &b->draft));
        json_object_set_new(answer, "best", json_string(o->file[best]));
        json_object_set_new(answer, "agree", json_boolean(agree));
        json_object_set_new(answer, "cloth", cloth_json(b, best == 0 ? o->px_per_mm : 0.0));
    }
    bool written = json_dumpf(answer, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(6)) == 0 && putchar('\n') != EOF;
    json_decref(answer);
    if (!written) return error_set(err, STATUS_IO, "cannot write the answer");
    if (best == o->n_file) return STATUS_NOT_FOUND; /* err holds the sentence of the last photograph */
    if (o->overlay == NULL) return STATUS_OK;
    const struct weave_picture picture = {g[best].image.pixel, g[best].image.width, g[best].image.height};
    return weave_overlay_write(&picture, &g[best].guess, o->overlay, err);
}

int phantom_command_detect(int argc, char **argv)
{
    static struct photograph_guess guess[MAX_PHOTOGRAPH];
    struct detect_option o;
    struct error err = {0};
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0) {
            fputs(usage, stdout);
            return 0;
        }
    if (parse(argc, argv, &o, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-phantom detect: %s\n", err.text);
        return 2;
    }
    json_t *list = json_array();
    status s = STATUS_OK;
    for (size_t i = 0; i < o.n_file && s == STATUS_OK; i++) s = detect_one(&o, i, &guess[i], list, &err);
    if (s == STATUS_OK) s = print_answer(&o, guess, list, &err);
    if (s != STATUS_OK) fprintf(stderr, "selvedge-phantom detect: %s\n", err.text);
    for (size_t i = 0; i < o.n_file; i++) image_release(&guess[i].image);
    json_decref(list);
    return s == STATUS_OK ? 0 : 1;
}
