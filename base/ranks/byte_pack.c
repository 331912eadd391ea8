#include "base/ranks/byte_pack.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

void byte_pack_put(struct byte_pack *p, const void *data, size_t n)
{
    if (n == 0 || p->failed) return;
    if (n > p->capacity - p->n) {
        size_t more = 2 * (p->n + n);
        char *grown = realloc(p->data, more);
        if (grown == NULL) {
            p->failed = true;
            return;
        }
        p->data = grown;
        p->capacity = more;
    }
    memcpy(p->data + p->n, data, n);
    p->n += n;
}

void byte_pack_release(struct byte_pack *p)
{
    free(p->data);
    *p = (struct byte_pack){0};
}

status byte_pack_check(const struct byte_pack *p, struct error *err)
{
    return p->failed ? error_set(err, STATUS_NO_MEMORY, "cannot send to the other ranks: out of memory") : STATUS_OK;
}

void byte_view_get(struct byte_view *v, void *to, size_t n)
{
    if (n > v->n) v->failed = true;
    if (v->failed) {
        memset(to, 0, n);
        return;
    }
    memcpy(to, v->data, n);
    v->data += n;
    v->n -= n;
}

void *byte_view_array(struct byte_view *v, size_t n_item, size_t n_bytes)
{
    if (n_item > v->n / n_bytes) v->failed = true;
    if (v->failed || n_item == 0) return NULL;
    void *array = malloc(n_item * n_bytes);
    if (array == NULL)
        v->failed = true;
    else
        byte_view_get(v, array, n_item * n_bytes);
    return array;
}

status byte_view_check(const struct byte_view *v, struct error *err)
{
    return v->failed || v->n > 0 ? error_set(err, STATUS_FORMAT, "a message of another rank has the wrong length")
                                 : STATUS_OK;
}
