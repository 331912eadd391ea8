#include "geometry/weave/weave_wif.h"
#include "base/files/durable.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum {
    FILE_LIMIT_BYTES = 16 << 20,
    MOST_THREAD = 4096, /* warps, and picks */
    MOST_SHAFT = 512,   /* and treadles */
    SET_WORDS = MOST_SHAFT / 64
};

/* A set of shafts or treadles, from 1. */
struct loom_set {
    bool stated;
    uint64_t bit[SET_WORDS];
};

/* The lists of the file that give the weave. */
enum loom_list { LIST_THREADING, LIST_TIEUP, LIST_TREADLING, LIST_LIFTPLAN, LIST_COUNT };

static const struct {
    const char *section, *item, *of; /* "warp thread 5 names shaft 9" */
    size_t n_item;
} list_of[LIST_COUNT] = {
    [LIST_THREADING] = {"THREADING", "warp thread", "shaft", MOST_THREAD},
    [LIST_TIEUP] = {"TIEUP", "treadle", "shaft", MOST_SHAFT},
    [LIST_TREADLING] = {"TREADLING", "pick", "treadle", MOST_THREAD},
    [LIST_LIFTPLAN] = {"LIFTPLAN", "pick", "shaft", MOST_THREAD},
};

struct wif_reader {
    const char *name;
    size_t line;
    char section[32];
    bool is_wif, sinking;
    size_t n_warp, n_weft, n_shaft, n_treadle; /* stated; 0: not */
    size_t last[LIST_COUNT];                   /* the highest item of each list */
    struct loom_set *list[LIST_COUNT];         /* item 1 first */
    struct file_ledger *ledger;
};

static status at_line(const struct wif_reader *r, const char *what, struct error *err)
{
    return error_set(err, STATUS_FORMAT, "cannot use draft '%s', line %zu: %s", r->name, r->line, what);
}

/* Cuts blanks at both ends. */
static char *trim(char *text)
{
    text += strspn(text, " \t\r");
    size_t n = strlen(text);
    while (n > 0 && strchr(" \t\r", text[n - 1]) != NULL) text[--n] = '\0';
    return text;
}

/* Reads a whole number of at most `most`, and moves past it. Returns false when there is none. */
static bool read_whole(const char **text, size_t most, size_t *value)
{
    char *end;
    *text += strspn(*text, " \t");
    if (**text < '0' || **text > '9') return false;
    const unsigned long long v = strtoull(*text, &end, 10);
    *text = end + strspn(end, " \t");
    *value = v;
    return v <= most;
}

/* ---- statements ---- */

/* "5=1,3": item 5 has 1 and 3. A 0 stands for nothing. */
static status read_item(struct wif_reader *r, enum loom_list l, const char *key, const char *value, struct error *err)
{
    size_t item, member;
    if (!read_whole(&key, list_of[l].n_item, &item) || item == 0 || *key != '\0')
        return at_line(r, "a list needs a number before the '=', of a thread that a loom can have", err);
    struct loom_set *set = &r->list[l][item - 1];
    if (set->stated) return at_line(r, "this number was stated before", err);
    set->stated = true;
    if (item > r->last[l]) r->last[l] = item;
    while (*value != '\0') {
        if (!read_whole(&value, MOST_SHAFT, &member))
            return at_line(r, "shafts and treadles are whole numbers up to 512 with commas between them", err);
        if (member > 0) set->bit[(member - 1) / 64] |= (uint64_t)1 << (member - 1) % 64;
        if (*value != ',' && *value != '\0') return at_line(r, "there is no comma between two numbers", err);
        value += *value == ',';
    }
    return STATUS_OK;
}

static status read_count(struct wif_reader *r, const char *value, size_t most, size_t *out, struct error *err)
{
    if (read_whole(&value, SIZE_MAX, out) && *value == '\0' && *out > 0 && *out <= most) return STATUS_OK;
    return *out > most ? error_set(err, STATUS_TOO_LARGE, "cannot use draft '%s', line %zu: more than %zu", r->name,
                                   r->line, most)
                       : at_line(r, "a count of threads, shafts or treadles is a whole number above 0", err);
}

/* Statements of which only one of the whole file has a meaning for the weave. */
static status read_setting(struct wif_reader *r, const char *key, const char *value, struct error *err)
{
    const bool weaving = strcasecmp(r->section, "WEAVING") == 0, threads = strcasecmp(key, "Threads") == 0;
    if (weaving && strcasecmp(key, "Shafts") == 0) return read_count(r, value, MOST_SHAFT, &r->n_shaft, err);
    if (weaving && strcasecmp(key, "Treadles") == 0) return read_count(r, value, MOST_SHAFT, &r->n_treadle, err);
    if (strcasecmp(r->section, "WARP") == 0 && threads) return read_count(r, value, MOST_THREAD, &r->n_warp, err);
    if (strcasecmp(r->section, "WEFT") == 0 && threads) return read_count(r, value, MOST_THREAD, &r->n_weft, err);
    if (weaving && strcasecmp(key, "Rising Shed") == 0)
        r->sinking = strcasecmp(value, "false") == 0 || strcasecmp(value, "off") == 0 || strcasecmp(value, "no") == 0 ||
                     strcmp(value, "0") == 0;
    return STATUS_OK;
}

/* Puts statements that have no use here into the ledger, the first of each kind. */
static void note_unused(const struct wif_reader *r, const char *key, const char *value)
{
    static const char threads[] = "the job states yarns and threads per centimetre",
                      kinds[] = "the job states the kinds of yarn and their order";
    static const struct {
        const char *section, *key, *name, *reason; /* key NULL: any */
    } known[] = {
        {"WIF", "Source Program", "program", "it changes nothing"},
        {"WARP", "Color", "warp color", kinds},
        {"WEFT", "Color", "weft color", kinds},
        {"WARP COLORS", NULL, "warp colors", kinds},
        {"WEFT COLORS", NULL, "weft colors", kinds},
        {"WARP", "Spacing", "warp spacing", threads},
        {"WEFT", "Spacing", "weft spacing", threads},
        {"WARP SPACING", NULL, "warp spacings", threads},
        {"WEFT SPACING", NULL, "weft spacings", threads},
        {"WARP", "Thickness", "warp thickness", threads},
        {"WEFT", "Thickness", "weft thickness", threads},
        {"WARP THICKNESS", NULL, "warp thicknesses", threads},
        {"WEFT THICKNESS", NULL, "weft thicknesses", threads},
        {"COLOR TABLE", NULL, "color table", kinds},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        if (strcasecmp(r->section, known[i].section) != 0) continue;
        if (known[i].key != NULL && strcasecmp(key, known[i].key) != 0) continue;
        const bool first = r->ledger != NULL && file_ledger_find(r->ledger, known[i].name) == NULL;
        if (first && known[i].key != NULL) file_ledger_add(r->ledger, known[i].name, known[i].reason, "%s", value);
        if (first && known[i].key == NULL)
            file_ledger_add(r->ledger, known[i].name, known[i].reason, "%s=%s ...", key, value);
    }
}

static status read_line(struct wif_reader *r, char *line, struct error *err)
{
    line = trim(line);
    if (line[0] == '\0' || line[0] == ';') return STATUS_OK;
    if (line[0] == '[') {
        char *end = strchr(line, ']');
        if (end == NULL) return at_line(r, "a section has no ']'", err);
        *end = '\0';
        snprintf(r->section, sizeof r->section, "%s", trim(line + 1));
        r->is_wif = r->is_wif || strcasecmp(r->section, "WIF") == 0;
        return r->is_wif ? STATUS_OK : at_line(r, "it does not begin with the section [WIF]", err);
    }
    if (!r->is_wif) return at_line(r, "it does not begin with the section [WIF]", err);
    char *value = strchr(line, '=');
    if (value == NULL) return STATUS_OK; /* of a section of text */
    *value++ = '\0';
    char *comment = strchr(value, ';');
    if (comment != NULL) *comment = '\0';
    const char *key = trim(line);
    value = trim(value);
    for (int l = 0; l < LIST_COUNT; l++)
        if (strcasecmp(r->section, list_of[l].section) == 0) return read_item(r, (enum loom_list)l, key, value, err);
    note_unused(r, key, value);
    return read_setting(r, key, value, err);
}

static status read_lines(struct wif_reader *r, char *data, size_t n_bytes, struct error *err)
{
    char *text = strncmp(data, "\xef\xbb\xbf", 3) == 0 ? data + 3 : data;
    if (memchr(data, '\0', n_bytes) != NULL)
        return at_line(r, "it is no text, or text in UTF-16: save it as UTF-8", err);
    status s = STATUS_OK;
    while (text != NULL && s == STATUS_OK) {
        char *end = text + strcspn(text, "\r\n");
        const bool two = end[0] == '\r' && end[1] == '\n', more = *end != '\0';
        *end = '\0';
        r->line++;
        s = read_line(r, text, err);
        text = more ? end + 1 + two : NULL;
    }
    if (s == STATUS_OK && !r->is_wif) s = at_line(r, "it does not begin with the section [WIF]", err);
    return s;
}

/* ---- the loom ---- */

static bool has(const struct loom_set *s, size_t member) { return (s->bit[member / 64] >> member % 64 & 1) != 0; }

/* Every item is stated, and names members that the loom has. n_member 0: not stated. */
static status check_list(const struct wif_reader *r, enum loom_list l, size_t n, size_t n_member, bool may_be_empty,
                         struct error *err)
{
    if (r->last[l] > n)
        return error_set(err, STATUS_FORMAT, "cannot use draft '%s': it states %zu threads, but [%s] has number %zu",
                         r->name, n, list_of[l].section, r->last[l]);
    for (size_t i = 0; i < n; i++) {
        const struct loom_set *s = &r->list[l][i];
        if (l == LIST_TIEUP && !s->stated) continue; /* a treadle that no pick may use */
        bool empty = true;
        for (size_t k = 0; k < SET_WORDS; k++) empty = empty && s->bit[k] == 0;
        if (!s->stated || (empty && !may_be_empty))
            return error_set(err, STATUS_FORMAT, "cannot use draft '%s': %s %zu has no %s in [%s]", r->name,
                             list_of[l].item, i + 1, list_of[l].of, list_of[l].section);
        for (size_t k = n_member; n_member > 0 && k < MOST_SHAFT; k++)
            if (has(s, k))
                return error_set(err, STATUS_FORMAT, "cannot use draft '%s': %s %zu names %s %zu, but there are %zu",
                                 r->name, list_of[l].item, i + 1, list_of[l].of, k + 1, n_member);
    }
    return STATUS_OK;
}

/* Fills in the lift plan from treadling and tie-up; where the file has both, they must agree. */
static status tread(struct wif_reader *r, struct error *err)
{
    const bool planned = r->last[LIST_LIFTPLAN] > 0;
    for (size_t p = 0; p < r->n_weft; p++) {
        struct loom_set lift = {.stated = true};
        for (size_t t = 0; t < MOST_SHAFT; t++) {
            if (!has(&r->list[LIST_TREADLING][p], t)) continue;
            if (!r->list[LIST_TIEUP][t].stated)
                return error_set(err, STATUS_FORMAT,
                                 "cannot use draft '%s': pick %zu uses treadle %zu, which is tied to no shaft", r->name,
                                 p + 1, t + 1);
            for (size_t k = 0; k < SET_WORDS; k++) lift.bit[k] |= r->list[LIST_TIEUP][t].bit[k];
        }
        struct loom_set *plan = &r->list[LIST_LIFTPLAN][p];
        if (planned && memcmp(plan->bit, lift.bit, sizeof lift.bit) != 0)
            return error_set(err, STATUS_FORMAT,
                             "cannot use draft '%s': for pick %zu the lift plan lifts other shafts than the treadling",
                             r->name, p + 1);
        *plan = lift;
    }
    return STATUS_OK;
}

static status check_loom(struct wif_reader *r, struct error *err)
{
    const bool trodden = r->last[LIST_TREADLING] > 0, planned = r->last[LIST_LIFTPLAN] > 0;
    if (r->last[LIST_THREADING] == 0 || (!trodden && !planned))
        return error_set(err, STATUS_FORMAT,
                         "cannot use draft '%s': it has no [%s], so it states no weave (a file of colors alone?)",
                         r->name, r->last[LIST_THREADING] == 0 ? "THREADING" : "TREADLING] and no [LIFTPLAN");
    const size_t n_pick = r->last[planned ? LIST_LIFTPLAN : LIST_TREADLING];
    if (r->n_warp == 0) r->n_warp = r->last[LIST_THREADING];
    if (r->n_weft == 0) r->n_weft = n_pick;
    status s = check_list(r, LIST_THREADING, r->n_warp, r->n_shaft, false, err);
    if (s == STATUS_OK) s = check_list(r, LIST_TIEUP, r->last[LIST_TIEUP], r->n_shaft, true, err);
    if (s == STATUS_OK && trodden) s = check_list(r, LIST_TREADLING, r->n_weft, r->n_treadle, true, err);
    if (s == STATUS_OK && planned) s = check_list(r, LIST_LIFTPLAN, r->n_weft, r->n_shaft, true, err);
    return s == STATUS_OK && trodden ? tread(r, err) : s;
}

static bool warp_is_above(const struct wif_reader *r, size_t pick, size_t warp)
{
    const struct loom_set *lift = &r->list[LIST_LIFTPLAN][pick], *shaft = &r->list[LIST_THREADING][warp];
    bool moved = false;
    for (size_t k = 0; k < SET_WORDS; k++) moved = moved || (lift->bit[k] & shaft->bit[k]) != 0;
    return moved != r->sinking;
}

/* Returns the least period of the rows, or of the columns, that the weave shows at least twice; n where there is none
 * and n itself is short enough; else 0. */
static size_t period(const bool *above, size_t n_warp, size_t n_weft, bool of_rows)
{
    const size_t n = of_rows ? n_weft : n_warp, n_line = of_rows ? 1 : n_weft;
    for (size_t p = 1; p <= WEAVE_WIF_MOST && 2 * p <= n; p++) {
        const size_t step = of_rows ? p * n_warp : p, length = (of_rows ? n_weft * n_warp : n_warp) - step;
        bool same = true;
        for (size_t j = 0; j < n_line && same; j++)
            same = memcmp(above + j * n_warp, above + j * n_warp + step, length * sizeof *above) == 0;
        if (same) return p;
    }
    return n <= WEAVE_WIF_MOST ? n : 0;
}

static status find_repeat(const struct wif_reader *r, struct weave_wif *w, struct error *err)
{
    bool *above = malloc(r->n_warp * r->n_weft * sizeof *above);
    if (above == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read a draft: out of memory");
    for (size_t j = 0; j < r->n_weft; j++)
        for (size_t i = 0; i < r->n_warp; i++) above[j * r->n_warp + i] = warp_is_above(r, j, i);
    w->n_warp = period(above, r->n_warp, r->n_weft, false);
    w->n_weft = period(above, r->n_warp, r->n_weft, true);
    for (size_t j = 0; j < w->n_weft; j++) {
        for (size_t i = 0; i < w->n_warp; i++) w->row[j][w->n_warp - 1 - i] = above[j * r->n_warp + i] ? '1' : '0';
        w->row[j][w->n_warp] = '\0';
    }
    free(above);
    if (w->n_warp > 0 && w->n_weft > 0) return STATUS_OK;
    return error_set(err, STATUS_TOO_LARGE,
                     "cannot use draft '%s': the weave of its %zu warps and %zu wefts does not repeat within %d %s",
                     r->name, r->n_warp, r->n_weft, WEAVE_WIF_MOST, w->n_warp == 0 ? "warps" : "wefts");
}

static void note_weave(const struct wif_reader *r, const struct weave_wif *w)
{
    file_ledger_add(r->ledger, "threads", NULL, "%zu warps and %zu wefts", r->n_warp, r->n_weft);
    file_ledger_add(r->ledger, "weave", NULL, "by %s, repeats after %zu warps and %zu wefts, %s shed",
                    r->last[LIST_TREADLING] > 0 ? "treadling" : "lift plan", w->n_warp, w->n_weft,
                    r->sinking ? "sinking" : "rising");
}

status weave_wif_read(const char *path, struct weave_wif *w, struct file_ledger *ledger, struct error *err)
{
    char *data = NULL;
    size_t n_bytes = 0;
    struct wif_reader r = {.name = path_file_name(path), .ledger = ledger};
    status s = file_read_all(path, FILE_LIMIT_BYTES, &data, &n_bytes, err);
    for (int l = 0; l < LIST_COUNT; l++) {
        r.list[l] = calloc(list_of[l].n_item, sizeof *r.list[l]);
        if (r.list[l] == NULL && s == STATUS_OK)
            s = error_set(err, STATUS_NO_MEMORY, "cannot read a draft: out of memory");
    }
    *w = (struct weave_wif){0};
    if (s == STATUS_OK) s = read_lines(&r, data, n_bytes, err);
    if (s == STATUS_OK) s = check_loom(&r, err);
    if (s == STATUS_OK) s = find_repeat(&r, w, err);
    if (s == STATUS_OK) note_weave(&r, w);
    for (int l = 0; l < LIST_COUNT; l++) free(r.list[l]);
    free(data);
    return s;
}
