/* Tags and verdicts of jobs. */
#include "server/store/store_rows.h"

#include <stdlib.h>
#include <string.h>

static int by_tag(const void *a, const void *b)
{
    const struct tag_count *x = a, *y = b;
    return strcmp(x->tag, y->tag);
}

/* Adds each tag between the spaces of text to the array. */
static status add_tags(const char *text, struct tag_count **tag, size_t *n, size_t *capacity, struct error *err)
{
    for (const char *at = text + strspn(text, " "); *at != '\0'; at += strspn(at, " ")) {
        size_t length = strcspn(at, " ");
        if (*n == *capacity) {
            size_t more = *capacity == 0 ? 64 : 2 * *capacity;
            struct tag_count *grown = realloc(*tag, more * sizeof *grown);
            if (grown == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot count tags: out of memory");
            *tag = grown;
            *capacity = more;
        }
        struct tag_count *one = &(*tag)[(*n)++];
        *one = (struct tag_count){.n = 1};
        if (length < sizeof one->tag) memcpy(one->tag, at, length);
        at += length;
    }
    return STATUS_OK;
}

status store_tag_count(struct store *store, const char *owner, struct tag_count **out, size_t *n_out, struct error *err)
{
    struct tag_count *tag = NULL;
    size_t n = 0, capacity = 0, n_kind = 0;
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             owner == NULL ? "SELECT tags FROM job WHERE deleted = 0 AND tags <> '' AND ?1 IS NULL"
                                           : "SELECT tags FROM job WHERE deleted = 0 AND tags <> '' AND owner = ?1",
                             "s", owner);
    enum store_step rc = STORE_DONE;
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        char text[STORE_TAGS_BYTES];
        store_text(q, 0, text, sizeof text);
        s = add_tags(text, &tag, &n, &capacity, err);
    }
    if (s == STATUS_OK && rc != STORE_DONE) s = store_error(&store->read, "cannot count tags", err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    if (s != STATUS_OK) {
        free(tag);
        return s;
    }
    if (n > 0) qsort(tag, n, sizeof *tag, by_tag);
    for (size_t i = 0; i < n; i++)
        if (n_kind > 0 && by_tag(&tag[n_kind - 1], &tag[i]) == 0)
            tag[n_kind - 1].n++;
        else
            tag[n_kind++] = tag[i];
    *out = tag;
    *n_out = n_kind;
    return STATUS_OK;
}

static status fill(struct store *store, void (*read)(void *context, const char *id, char code[40]), void *context,
                   struct error *err)
{
    struct store_query *q = NULL;
    enum store_step rc = STORE_DONE;
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    s = store_prepare(&store->write, &q, err, "SELECT id FROM job WHERE verdict = ?", "s", "?");
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        char id[STORE_ID_BYTES], code[40] = "";
        store_text(q, 0, id, sizeof id);
        read(context, id, code);
        s = store_run(&store->write, NULL, err, "UPDATE job SET verdict = ? WHERE id = ?", "ss", code, id);
    }
    if (s == STATUS_OK && rc != STORE_DONE) s = store_error(&store->write, "cannot read the jobs", err);
    store_finish(q);
    return store_end(&store->write, s, err);
}

status store_fill_verdicts(struct store *store, void (*read)(void *context, const char *id, char code[40]),
                           void *context, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = fill(store, read, context, err);
    pthread_mutex_unlock(&store->write.lock);
    return s;
}
