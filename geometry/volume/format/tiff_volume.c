#include "geometry/volume/format/tiff_volume.h"
#include "base/files/durable.h"
#include "base/option_id.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MAX_PAGE = 1 << 20 };

/* Removes "path: ", with which libtiff starts some texts: users know the file by its name, and must not see folders
 * of the server. */
static void drop_path(struct tiff_stack *h)
{
    size_t n = strlen(h->path[h->i_open]);
    if (strncmp(h->message, h->path[h->i_open], n) != 0 || strncmp(h->message + n, ": ", 2) != 0) return;
    memmove(h->message, h->message + n + 2, strlen(h->message + n + 2) + 1);
}

static int keep_message(TIFF *tiff, void *user, const char *module, const char *format, va_list argument)
{
    (void)tiff;
    (void)module;
    struct tiff_stack *h = user;
    if (h->message[0] == '\0') {
        vsnprintf(h->message, sizeof h->message, format, argument);
        size_t n = strlen(h->message);
        if (n > 0 && h->message[n - 1] == '.') h->message[n - 1] = '\0';
        drop_path(h);
    }
    return 1; /* handled: libtiff does not call its global handlers, which print */
}

static int drop_message(TIFF *tiff, void *user, const char *module, const char *format, va_list argument)
{
    (void)tiff, (void)user, (void)module, (void)format, (void)argument;
    return 1;
}

const char *tiff_stack_cause(const struct tiff_stack *h) { return h->message[0] != '\0' ? h->message : "damaged data"; }

status tiff_stack_open_file(struct tiff_stack *h, size_t i_path, struct error *err)
{
    if (h->tiff != NULL && h->i_open == i_path) return STATUS_OK;
    if (h->tiff != NULL) TIFFClose(h->tiff);
    h->tiff = NULL;
    h->message[0] = '\0';
    const char *name = path_file_name(h->path[i_path]);
    struct stat st;
    if (stat(h->path[i_path], &st) != 0) {
        if (errno == ENOENT)
            return error_set_field(err, STATUS_NOT_FOUND, OPTION_SCAN_FILES, "cannot read volume '%s': no such file",
                                   name);
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", name);
    }
    if (st.st_size == 0)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': the file is empty",
                               name);
    TIFFOpenOptions *option = TIFFOpenOptionsAlloc();
    if (option == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume '%s': out of memory", name);
    TIFFOpenOptionsSetErrorHandlerExtR(option, keep_message, h);
    TIFFOpenOptionsSetWarningHandlerExtR(option, drop_message, h);
    h->i_open = i_path;
    /* m: no memory map, because a file that is too short would raise SIGBUS */
    h->tiff = TIFFOpenExt(h->path[i_path], "rm", option);
    TIFFOpenOptionsFree(option);
    if (h->tiff == NULL)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s", name,
                               tiff_stack_cause(h));
    return STATUS_OK;
}

status tiff_stack_add(struct tiff_stack *h, struct tiff_slice slice, struct error *err)
{
    if (h->n_slice == MAX_PAGE)
        return error_set_field(err, STATUS_TOO_LARGE, OPTION_SCAN_FILES, "cannot read volume '%s': over %d pages",
                               path_file_name(h->path[0]), MAX_PAGE);
    if (h->n_slice == h->capacity) {
        size_t n = h->capacity == 0 ? 256 : h->capacity * 2;
        struct tiff_slice *bigger = realloc(h->slice, n * sizeof *bigger);
        if (bigger == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
        h->slice = bigger;
        h->capacity = n;
    }
    h->slice[h->n_slice++] = slice;
    return STATUS_OK;
}
