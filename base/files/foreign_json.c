#include "base/files/foreign_json.h"
#include "base/files/foreign_file.h"

#include <errno.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Memory that jansson 2.14 takes on a 64-bit machine, with the overhead of malloc. */
enum { OBJECT_BYTES = 256, LIST_BYTES = 144, STRING_BYTES = 64, KEY_BYTES = 80, VALUE_BYTES = 48 };
enum { CHUNK_BYTES = 1 << 16, NAME_BYTES = 64 };

/* Reads a text byte by byte and copies the part to be parsed. */
struct sieve {
    const struct foreign_bounds *bounds;
    char *kept;
    size_t n_kept, capacity, held;
    unsigned depth;
    bool in_string, escaped, ended;
    bool is_object; /* the outermost value */
    /* with bounds->member, in the outermost object: */
    bool before_name, in_name, wanted;
    size_t n_member, n_name;
    char name[NAME_BYTES];
    status s;
    struct error *err;
};

static void refuse(struct sieve *v, status code, const char *why) { v->s = error_set(v->err, code, "%s", why); }

static void keep(struct sieve *v, const char *text, size_t n)
{
    if (v->n_kept + n > v->capacity) {
        size_t more = v->capacity == 0 ? 4096 : 2 * v->capacity;
        while (more < v->n_kept + n) more *= 2;
        char *grown = realloc(v->kept, more);
        if (grown == NULL) {
            refuse(v, STATUS_NO_MEMORY, "out of memory");
            return;
        }
        v->kept = grown;
        v->capacity = more;
    }
    memcpy(v->kept + v->n_kept, text, n);
    v->n_kept += n;
}

static bool is_wanted(const struct sieve *v)
{
    for (const char *const *name = v->bounds->member; v->n_name < NAME_BYTES && *name != NULL; name++)
        if (strlen(*name) == v->n_name && memcmp(*name, v->name, v->n_name) == 0) return true;
    return false;
}

static void end_name(struct sieve *v)
{
    v->in_name = v->before_name = false;
    v->wanted = is_wanted(v);
    if (!v->wanted) return;
    if (v->n_member > 0) keep(v, ",", 1);
    keep(v, "\"", 1);
    keep(v, v->name, v->n_name);
    keep(v, "\"", 1);
    v->n_member++;
    v->held += STRING_BYTES + v->n_name;
}

static void pass_string(struct sieve *v, char c)
{
    const bool ends = c == '"' && !v->escaped;
    v->escaped = c == '\\' && !v->escaped;
    if (ends) v->in_string = false;
    if (v->in_name && !ends && v->n_name < NAME_BYTES) v->name[v->n_name++] = c;
    if (v->in_name && ends) end_name(v);
}

static void open_value(struct sieve *v, char c)
{
    if (v->depth++ == 0) v->is_object = v->before_name = c == '{';
    if (v->depth > v->bounds->depth) refuse(v, STATUS_TOO_LARGE, "its values are nested too deeply");
}

/* Returns the estimated memory of the value that a byte outside of strings begins. */
static size_t weight(char c)
{
    switch (c) {
    case '{':
        return OBJECT_BYTES;
    case '[':
        return LIST_BYTES;
    case '"':
        return STRING_BYTES;
    case ':':
        return KEY_BYTES;
    case ',':
        return VALUE_BYTES;
    default:
        return 0;
    }
}

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/* Takes a byte outside of strings. Returns whether it belongs to the part to be parsed. */
static bool pass_token(struct sieve *v, char c)
{
    const bool filtered = v->bounds->member != NULL;
    bool in_member = !filtered || v->wanted;
    if (v->ended || (v->depth == 0 && c != '{' && c != '[')) {
        if (!is_blank(c)) refuse(v, STATUS_FORMAT, "it is no JSON list or object");
        return false;
    }
    if (c == '"') {
        v->in_string = true;
        v->in_name = filtered && v->depth == 1 && v->is_object && v->before_name;
        if (v->in_name) v->n_name = 0;
        in_member = in_member && !v->in_name;
    } else if (c == '{' || c == '[') {
        in_member = in_member || v->depth == 0;
        open_value(v, c);
    } else if (c == '}' || c == ']') {
        in_member = in_member || v->depth == 1;
        v->ended = --v->depth == 0;
    } else if (c == ',' && v->depth == 1 && filtered && v->is_object) {
        v->before_name = true;
        v->wanted = in_member = false;
    }
    return in_member;
}

static void pass(struct sieve *v, const char *text, size_t n)
{
    for (size_t i = 0; i < n && v->s == STATUS_OK; i++) {
        const char c = text[i];
        if ((unsigned char)c < ' ' && (v->in_string || !is_blank(c)))
            refuse(v, STATUS_FORMAT, "it has control characters");
        bool kept = v->bounds->member == NULL || v->wanted;
        if (v->in_string) {
            kept = kept && !v->in_name;
            pass_string(v, c);
            v->held += 2 * (size_t)kept; /* in the text and in the value */
        } else {
            kept = pass_token(v, c);
            if (kept) v->held += 1 + weight(c);
        }
        if (v->held > v->bounds->held_bytes) refuse(v, STATUS_TOO_LARGE, "its values would take too much memory");
        if (kept) keep(v, &c, 1);
    }
}

static status finish(struct sieve *v, json_t **json)
{
    json_error_t where;
    if (v->s == STATUS_OK && !v->ended) refuse(v, STATUS_FORMAT, "it is cut off");
    *json = v->s == STATUS_OK ? json_loadb(v->kept, v->n_kept, JSON_REJECT_DUPLICATES, &where) : NULL;
    if (v->s == STATUS_OK && *json == NULL)
        v->s = error_set(v->err, STATUS_FORMAT, "line %d: %s", where.line, where.text);
    free(v->kept);
    return v->s;
}

status foreign_json_parse(const char *text, size_t n, const struct foreign_bounds *bounds, size_t *held, json_t **json,
                          struct error *err)
{
    struct sieve v = {.bounds = bounds, .err = err};
    pass(&v, text, n);
    if (held != NULL) *held = v.held;
    return finish(&v, json);
}

static void pass_file(struct sieve *v, int fd)
{
    uint64_t left = v->bounds->file_bytes; /* it may grow while it is read */
    char *chunk = malloc(CHUNK_BYTES);
    if (chunk == NULL) refuse(v, STATUS_NO_MEMORY, "out of memory");
    while (v->s == STATUS_OK) {
        ssize_t n = read(fd, chunk, CHUNK_BYTES);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) v->s = error_set_errno(v->err, "it cannot be read");
        if (n <= 0) break;
        if ((uint64_t)n > left) refuse(v, STATUS_TOO_LARGE, "it is too large");
        left -= (uint64_t)n;
        pass(v, chunk, (size_t)n);
    }
    free(chunk);
}

status foreign_json_read(const char *folder, const char *name, const struct foreign_bounds *bounds, json_t **json,
                         struct error *err)
{
    struct sieve v = {.bounds = bounds, .err = err};
    uint64_t size = 0;
    int fd = -1;
    status s = foreign_file_open(folder, name, &fd, &size, err);
    if (s != STATUS_OK) return s;
    if (size > bounds->file_bytes)
        refuse(&v, STATUS_TOO_LARGE, "it is too large");
    else
        pass_file(&v, fd);
    close(fd);
    if (v.s == STATUS_OK && !v.is_object) refuse(&v, STATUS_FORMAT, "it is no JSON object");
    s = finish(&v, json);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot read '%s' in '%s'", name, folder);
}
