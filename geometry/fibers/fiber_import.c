#include "geometry/fibers/fiber_import.h"
#include "base/files/durable.h"
#include "base/files/reading_note.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

enum { LOOK_BYTES = 128 };
static const char mitsuba[] = "BINARY_HAIR";

/* Whether bytes can be text: no NUL and no other control characters than ends of lines and tabs. */
static bool is_text(const char *data, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if ((unsigned char)data[i] < ' ' && strchr("\t\r\n", data[i]) == NULL) return false;
    return memchr(data, '\0', n) == NULL;
}

status fiber_import(struct fiber_set *f, const char *path, const struct fiber_file_terms *terms, struct error *err)
{
    char data[LOOK_BYTES];
    FILE *file = fopen(path, "rbe");
    if (file == NULL) return error_set_errno(err, "cannot read fibers '%s'", path_file_name(path));
    const size_t n = fread(data, 1, sizeof data, file);
    fclose(file);
    const bool is_mitsuba = n >= sizeof mitsuba - 1 && memcmp(data, mitsuba, sizeof mitsuba - 1) == 0;
    reading_note_set("fibers", path);
    status s = is_mitsuba         ? fiber_import_mitsuba(f, path, terms, err)
               : is_text(data, n) ? fiber_import_text(f, path, terms, err)
                                  : fiber_import_hair(f, path, terms, err);
    reading_note_set(NULL, NULL);
    return s;
}

void fiber_import_statements(const char *path, struct file_ledger *ledger, double tile_size_m[2])
{
    uint8_t head[LOOK_BYTES] = {0};
    tile_size_m[0] = tile_size_m[1] = 0.0;
    FILE *file = fopen(path, "rbe");
    if (file == NULL) return;
    if (fread(head, 1, sizeof head, file) == sizeof head && memcmp(head, "HAIR", 4) == 0)
        fiber_import_hair_statements(head, ledger, tile_size_m);
    fclose(file);
}

status fiber_set_read_hair(struct fiber_set *f, const char *path, struct error *err)
{
    return fiber_import_hair(f, path, &(struct fiber_file_terms){.radius_m = NAN}, err);
}

status fiber_set_read_text(struct fiber_set *f, const char *path, struct error *err)
{
    return fiber_import_text(f, path, &(struct fiber_file_terms){.radius_m = NAN}, err);
}
