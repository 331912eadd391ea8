/* Bytes of a message between ranks, written and read one value after the other. Host byte order. */
#ifndef SELVEDGE_BASE_BYTE_PACK_H
#define SELVEDGE_BASE_BYTE_PACK_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

/* Grows as it is written; all zero: empty. */
struct byte_pack {
    char *data; /* owned */
    size_t n, capacity;
    bool failed; /* out of memory: all later bytes are missing */
};

/* A part of a message that is read; `failed` once more was asked for than there is. */
struct byte_view {
    const char *data;
    size_t n;
    bool failed;
};

void byte_pack_put(struct byte_pack *p, const void *data, size_t n);
void byte_pack_release(struct byte_pack *p);
/* STATUS_NO_MEMORY when something could not be written. */
status byte_pack_check(const struct byte_pack *p, struct error *err);

/* Copies n bytes out; zeros when there are fewer. */
void byte_view_get(struct byte_view *v, void *to, size_t n);
/* n_item items of n_bytes each as an array of its own, which the caller frees; NULL when v fails, without memory (v
 * fails then, too) and for no items. */
void *byte_view_array(struct byte_view *v, size_t n_item, size_t n_bytes);
/* STATUS_FORMAT when more was asked for than there was, or when something is left. */
status byte_view_check(const struct byte_view *v, struct error *err);

#define BYTE_PACK(pack, value) byte_pack_put(pack, &(value), sizeof(value))
#define BYTE_VIEW(view, value) byte_view_get(view, &(value), sizeof(value))

#endif
