/* Fibers from files of any program. The kind of a file is recognised by its content. */
#ifndef SELVEDGE_GEOMETRY_FIBER_IMPORT_H
#define SELVEDGE_GEOMETRY_FIBER_IMPORT_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/fiber_terms.h"

/* Reads Cem Yuksel's .hair, Mitsuba 0.6's binary hair ("BINARY_HAIR"), or text (fiber_set.h), which Mitsuba's text of
 * "x y z" or "x y z radius" is too. Errors as in fiber_set_read_hair and fiber_set_read_text; STATUS_INVALID with field
 * OPTION_FIBER_RADIUS when neither job nor file state a radius, or both do. */
status fiber_import(struct fiber_set *f, const char *path, const struct fiber_file_terms *terms, struct error *err);

/* Adds the statements of a file to a ledger as fiber_import does, from the head of the file alone, and sets its tile
 * (0: not stated). Files that cannot be read state nothing. */
void fiber_import_statements(const char *path, struct file_ledger *ledger, double tile_size_m[2]);

/* The readers of single kinds, as fiber_import. */
status fiber_import_hair(struct fiber_set *f, const char *path, const struct fiber_file_terms *terms,
                         struct error *err);
status fiber_import_text(struct fiber_set *f, const char *path, const struct fiber_file_terms *terms,
                         struct error *err);
/* header: the first 128 bytes of the file. */
void fiber_import_hair_statements(const uint8_t header[128], struct file_ledger *ledger, double tile_size_m[2]);
status fiber_import_mitsuba(struct fiber_set *f, const char *path, const struct fiber_file_terms *terms,
                            struct error *err);

#endif
