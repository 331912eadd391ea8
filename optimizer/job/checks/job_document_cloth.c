/* The section "cloth": from its keys to a checked description of the cloth. */
#include "base/catalogue/cloth_description.h"
#include "base/catalogue/correction_numbers.h"
#include "optimizer/job/checks/job_document_parts.h"
#include "optimizer/job/checks/job_film.h"
#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/job_cloth.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Puts the section before the field, and before its name where the text quotes it. */
static void name_section(const char *section, struct error *err)
{
    char field[sizeof err->field], text[sizeof err->text], quoted[sizeof err->field];
    const size_t n = strlen(section);
    if (err == NULL || (strncmp(err->field, section, n) == 0 && strchr(".[", err->field[n]) != NULL)) return;
    snprintf(quoted, sizeof quoted, "'%.100s'", err->field);
    const char *at = err->field[0] != '\0' ? strstr(err->text, quoted) : NULL;
    if (at != NULL) {
        snprintf(text, sizeof text, "%.*s'%s.%s", (int)(at - err->text), err->text, section, at + 1);
        memcpy(err->text, text, sizeof text);
    }
    snprintf(field, sizeof field, "%s%s%.100s", section, err->field[0] != '\0' ? "." : "", err->field);
    memcpy(err->field, field, sizeof field);
}

void job_cloth_name_field(struct error *err) { name_section("cloth", err); }

void job_cloth_films(const struct job_cloth *cloth, struct film_groups *films)
{
    memset(films, 0, sizeof *films);
    if (cloth->description != NULL) cloth_film_groups(cloth->description, films);
}

static status read_draft(const json_t *list, struct cloth_description *d, struct error *err)
{
    const char *row[CLOTH_MAX_DRAFT];
    size_t n = json_array_size(list);
    if (!json_is_array(list) || n == 0 || n > CLOTH_MAX_DRAFT)
        return error_set_field(err, STATUS_INVALID, "cloth.draft", "'cloth.draft' must be a list of 1 to %d texts",
                               CLOTH_MAX_DRAFT);
    for (size_t i = 0; i < n; i++) {
        row[i] = json_string_value(json_array_get(list, i));
        if (row[i] == NULL)
            return error_set_field(err, STATUS_INVALID, "cloth.draft", "row %zu of 'cloth.draft' is no text", i);
    }
    return cloth_description_draft(d, row, n, err);
}

static status read_order(const json_t *section, enum cloth_direction direction, struct cloth_description *d,
                         struct error *err)
{
    const char *key = direction == CLOTH_WARP ? "warp" : "weft";
    const json_t *list = json_object_get(section, key);
    size_t n = json_array_size(list);
    if (list == NULL) return STATUS_OK;
    if (!json_is_array(list) || n == 0 || n > CLOTH_MAX_ORDER)
        return error_set_field(err, STATUS_INVALID, key, "'cloth.%s' must be a list of 1 to %d kinds of yarn", key,
                               CLOTH_MAX_ORDER);
    d->n_order[direction] = n;
    for (size_t i = 0; i < n; i++) {
        const json_t *kind = json_array_get(list, i);
        if (!json_is_integer(kind) || json_integer_value(kind) < 0 || json_integer_value(kind) >= (int)d->n_kind)
            return error_set_field(err, STATUS_INVALID, key,
                                   "element %zu of 'cloth.%s' must be one of the %zu kinds 0..%zu", i, key, d->n_kind,
                                   d->n_kind - 1);
        d->order[direction][i] = (uint8_t)json_integer_value(kind);
    }
    return STATUS_OK;
}

/* Reads a number given as an object: {value, lower, upper, prior, fit}. */
static status read_searched(const struct json_field *f, struct cloth_number *n, struct error *err)
{
    static const char *const key[] = {"value", "lower", "upper", "prior", "fit", NULL};
    double prior[2] = {NAN, NAN};
    n->fitted = true;
    status st = json_field_check_keys(f, key, err);
    if (st == STATUS_OK) st = json_field_number(f, "value", n->info->lower, n->info->upper, &n->value, err);
    if (st == STATUS_OK) st = json_field_number(f, "lower", n->info->lower, n->info->upper, &n->lower, err);
    if (st == STATUS_OK) st = json_field_number(f, "upper", n->info->lower, n->info->upper, &n->upper, err);
    if (st == STATUS_OK) st = json_field_number_array(f, "prior", 2, -1e9, 1e9, prior, err);
    if (st == STATUS_OK) st = json_field_bool(f, "fit", &n->fitted, err);
    n->prior_mean = prior[0];
    n->prior_sd = prior[1];
    if (json_object_get(f->object, "value") == NULL) n->value = fmin(fmax(n->value, n->lower), n->upper);
    return st;
}

static status read_number(const struct json_field *f, struct cloth_number *n, struct error *err)
{
    struct json_field sub = {.object = json_object_get(f->object, n->info->name)};
    if (sub.object == NULL) return STATUS_OK;
    json_field_path(f, n->info->name, sub.path);
    if (json_is_object(sub.object)) return read_searched(&sub, n, err);
    return json_field_required_number(f, n->info->name, n->info->lower, n->info->upper, &n->value, err);
}

/* Which cloths have a number of the catalogue. */
static const char *who_has(const struct cloth_number_info *i)
{
    switch (i->structures) {
    case CLOTH_HAS_WARP_COVER:
        return "weaves and velvets without 'warp_per_cm' have it";
    case CLOTH_HAS_WEFT_COVER:
        return "weaves and velvets without 'weft_per_cm' have it";
    case CLOTH_HAS_MELANGE:
        return "it needs 'melange_with', the other kind of yarn";
    case CLOTH_HAS_PLIES:
        return "it needs 'plies' of 2 or more";
    case CLOTH_HAS_WEAVE:
        return "weaves and velvets have it";
    case CLOTH_HAS_LOOPS:
        return "knits have it";
    case CLOTH_HAS_PILE:
        return "velvets have it, those of a yarn for their last kind";
    case CLOTH_HAS_FELT:
        return "felts have it";
    default:
        return "cloths of yarns have it, not felts and piles";
    }
}

/* Refuses numbers of the catalogue that this cloth, or this kind of yarn, does not have. */
static status check_surplus(const struct json_field *f, int kind, const struct cloth_description *d, struct error *err)
{
    for (const struct cloth_number_info *i = cloth_number_table; i->name != NULL; i++) {
        if (i->of_yarn != (kind >= 0) || json_object_get(f->object, i->name) == NULL) continue;
        if (!isnan(cloth_number_value(d, NULL, kind, i->name))) continue;
        char path[JSON_PATH_BYTES];
        json_field_path(f, i->name, path);
        return error_set_field(err, STATUS_INVALID, path, "this cloth has no number '%s': %s", path, who_has(i));
    }
    return STATUS_OK;
}

/* Refuses counts and orders of yarns that a knit or a felt does not have. */
static status check_yarn_keys(const json_t *section, const struct cloth_description *d, struct error *err)
{
    static const char *const key[] = {"warp_per_cm", "weft_per_cm", "warp", "tile_warps", "weft", "tile_wefts"};
    size_t n = d->structure == CLOTH_FELT ? 6 : d->structure == CLOTH_KNIT ? 3 : 0;
    for (size_t i = 0; i < n; i++)
        if (json_object_get(section, key[i]) != NULL)
            return error_set_field(err, STATUS_INVALID, key[i], "'cloth.%s' is for woven cloth: a %s has none", key[i],
                                   d->weave);
    return STATUS_OK;
}

static struct json_field field_of(const json_t *section, int kind)
{
    struct json_field f = {.object = section, .path = "cloth"};
    if (kind < 0) return f;
    f.object = json_array_get(json_object_get(section, "yarns"), (size_t)kind);
    snprintf(f.path, sizeof f.path, "cloth.yarns[%d]", kind);
    return f;
}

static status read_numbers(const json_t *section, const struct job_cloth *cloth, struct cloth_description *d,
                           struct error *err)
{
    status st = STATUS_OK;
    for (int k = -1; k < (int)d->n_kind && st == STATUS_OK; k++) {
        struct json_field f = field_of(section, k);
        if (f.object != NULL) st = check_surplus(&f, k, d, err);
        if (f.object != NULL && st == STATUS_OK)
            st = k < 0 ? job_film_check_keys(&f, "sequin_", "sequin_diameter_um", &cloth->sequins, err)
                       : job_film_check_keys(&f, "film_", "film_width_um", &cloth->yarn[k].film, err);
    }
    for (size_t i = 0; i < d->n_number && st == STATUS_OK; i++) {
        struct json_field f = field_of(section, d->number[i].kind);
        if (f.object != NULL) st = read_number(&f, &d->number[i], err);
    }
    return st;
}

static void take_film(const struct job_film *from, struct cloth_kind *kind)
{
    if (isnan(from->width_um)) return;
    kind->film = (struct cloth_film){
        .width_um = from->width_um, .thickness_um = from->thickness_um, .wraps_per_m = from->wraps_per_m};
    job_film_take_material(from, &kind->film.material);
}

static void take_sequins(const struct job_film *from, struct cloth_sequins *q)
{
    if (isnan(from->width_um)) return;
    *q = (struct cloth_sequins){.diameter_um = from->width_um,
                                .thickness_um = from->thickness_um,
                                .spacing_um = from->spacing_um,
                                .row_spacing_um = from->row_spacing_um,
                                .tilt_deg = from->tilt_deg,
                                .tilt_spread_deg = from->tilt_spread_deg};
    job_film_take_material(from, &q->material);
}

static void take_kinds(const struct job_cloth *cloth, const json_t *section, struct cloth_description *d)
{
    const json_t *yarns = json_object_get(section, "yarns");
    if (cloth->n_yarn == 0) return;
    struct cloth_kind ground = d->kind[0], pile = d->kind[1];
    d->n_kind = cloth->n_yarn;
    if (d->pile_kind >= 0) d->pile_kind = (int)d->n_kind - 1;
    for (size_t k = 0; k < d->n_kind; k++) {
        const struct job_cloth_yarn *y = &cloth->yarn[k];
        d->kind[k] = (int)k == d->pile_kind ? pile : ground;
        if (y->n_fiber > 0 || !isnan(y->film.width_um)) d->kind[k].n_fiber = y->n_fiber;
        take_film(&y->film, &d->kind[k]);
        d->kind[k].n_ply = y->n_ply;
        if (json_object_get(json_array_get(yarns, k), "melange_with") != NULL)
            d->kind[k].melange_with = (int)y->melange_with;
    }
}

static status read_weave(const json_t *section, struct job_cloth *cloth, struct cloth_description *d, struct error *err)
{
    const json_t *draft = json_object_get(section, "draft");
    const bool named = json_object_get(section, "weave") != NULL, filed = cloth->draft_file[0] != '\0';
    const int n_given = named + filed + (draft != NULL);
    if (n_given > 1 || (n_given == 0 && cloth->texture[0] == '\0'))
        return error_set_field(err, STATUS_INVALID, "cloth.weave",
                               "a described cloth takes one of 'cloth.weave', 'cloth.draft' and 'cloth.draft_file', or "
                               "none of them with a photograph in 'cloth.texture'");
    cloth->draft_from_texture = n_given == 0;
    /* until a file or a photograph is read, the weave stands as plain */
    status st = cloth_description_init(d, named ? cloth->weave : "plain", err);
    return st == STATUS_OK && draft != NULL ? read_draft(draft, d, err) : st;
}

static status read_cloth(const json_t *section, struct job_cloth *cloth, struct cloth_description *d, struct error *err)
{
    status st = read_weave(section, cloth, d, err);
    if (st == STATUS_OK) st = check_yarn_keys(section, d, err);
    if (st != STATUS_OK) return st;
    take_kinds(cloth, section, d);
    take_sequins(&cloth->sequins, &d->sequins);
    if (d->pile_kind == 0)
        return error_set_field(err, STATUS_INVALID, "cloth.yarns",
                               "a velvet has at least two kinds of yarn: the ground, and last the pile");
    d->seed = cloth->seed;
    for (int k = 0; k < 2 && st == STATUS_OK; k++) {
        enum cloth_direction a = k == 0 ? CLOTH_WEFT : CLOTH_WARP;
        /* the tile of a draft that is not known yet is checked when it is */
        const bool open = cloth->draft_from_texture || cloth->draft_file[0] != '\0';
        d->n_yarn[a] = open ? 0 : cloth->tile_yarn[a];
        if (!isnan(cloth->threads_per_cm[a])) d->threads_per_cm[a] = cloth->threads_per_cm[a];
        st = read_order(section, a, d, err);
    }
    cloth_description_number(d);
    if (st == STATUS_OK) st = read_numbers(section, cloth, d, err);
    return st == STATUS_OK ? cloth_description_check(d, err) : st;
}

/* Reads the names of the kinds of yarn, which are the groups of fibers: all that have fibers have one, or none. */
static status read_names(struct job_cloth *cloth, struct error *err)
{
    const size_t n_fiber_kind = cloth->n_yarn > 0 ? cloth_n_fiber_kind(cloth->description) : 0;
    size_t n_named = 0;
    status s = STATUS_OK;
    for (size_t k = 0; k < cloth->n_yarn; k++) n_named += cloth->yarn[k].name[0] != '\0';
    for (size_t k = 0; k < cloth->n_yarn && n_named > 0 && s == STATUS_OK; k++) {
        memcpy(cloth->description->kind[k].name, cloth->yarn[k].name, sizeof cloth->description->kind[k].name);
        char path[JSON_PATH_BYTES];
        snprintf(path, sizeof path, "cloth.yarns[%zu].name", k);
        if (k >= n_fiber_kind && cloth->yarn[k].name[0] == '\0') continue;
        s = n_named == n_fiber_kind
                ? job_add_group(cloth, cloth->yarn[k].name, path, err)
                : error_set_field(err, STATUS_INVALID, path,
                                  "'%s': either all kinds of yarn that have fibers have a name, or none", path);
    }
    return s;
}

/* A key of the cloth: job_cloth_name_field makes it one of the document. */
static const char final_tiles_key[] = "final_tiles", renew_places_key[] = "renew_places";

status job_cloth_check_final_tiles(const struct job_cloth *cloth, struct error *err)
{
    bool fitted = false;
    for (size_t i = 0; i < cloth->description->n_number; i++) fitted = fitted || cloth->description->number[i].fitted;
    if (!fitted && cloth->final_tiles > 1)
        return error_set_field(err, STATUS_INVALID, final_tiles_key,
                               "'final_tiles' is for a cloth whose numbers are fitted: this one has none, so its tile "
                               "is that of 'tile_warps' and 'tile_wefts', or of 'fibers' in a felt");
    if (!fitted && cloth->renew_places)
        return error_set_field(err, STATUS_INVALID, renew_places_key,
                               "'renew_places' is for a cloth whose numbers are fitted: this one has none, so it is "
                               "made once");
    struct cloth_description *large = malloc(sizeof *large);
    if (large == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    status st = cloth_description_enlarge(cloth->description, cloth->final_tiles, large, err);
    free(large);
    return st;
}

status job_check_cloth(const struct option_value *v, struct error *err)
{
    struct job_cloth *cloth = v->own;
    cloth->description = calloc(1, sizeof *cloth->description);
    if (cloth->description == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    status st = read_cloth(v->value, cloth, cloth->description, err);
    if (st == STATUS_OK) st = read_names(cloth, err);
    if (st == STATUS_OK) st = job_cloth_check_final_tiles(cloth, err);
    if (st == STATUS_INVALID) job_cloth_name_field(err);
    return st;
}

status job_check_correction(const struct option_value *v, struct error *err)
{
    struct job_cloth *cloth = v->own;
    const struct json_field f = {.object = v->value, .path = "correction"};
    status s = STATUS_OK;
    if (cloth->description != NULL)
        return error_set_field(
            err, STATUS_INVALID, "correction",
            "'correction' is for fibers of a scan or a file: a described cloth has numbers of its own");
    correction_numbers_init(cloth->correction);
    for (int k = 0; k < CORRECTION_N && s == STATUS_OK; k++) s = read_number(&f, &cloth->correction[k], err);
    if (s == STATUS_OK) s = correction_numbers_check(cloth->correction, err);
    if (s == STATUS_INVALID) name_section("correction", err);
    return s;
}
