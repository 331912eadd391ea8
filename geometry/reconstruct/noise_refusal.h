/* Refuses scans of noise alone, in which lines of noise would be traced for minutes. */
#ifndef SELVEDGE_GEOMETRY_NOISE_REFUSAL_H
#define SELVEDGE_GEOMETRY_NOISE_REFUSAL_H

#include "base/warning.h"
#include "geometry/reconstruct/reconstruct.h"

/* Returns STATUS_INVALID, with the field OPTION_SCAN_FILES, for a scan of noise alone: void and material cannot be told
 * apart by its separability (density_map.h), and it has no structure (scan_structure.h). Who states the diameter of the
 * fibers knows that there are some, so nothing is refused then. Errors of scan_structure_measure. */
status noise_refuse(const struct volume *v, double separability, const struct reconstruct_option *o,
                    struct thread_pool *pool, struct error *err);

/* The same before a job starts: looks at slices in the middle of the scan, and at all of a small scan if these show
 * noise alone. A large scan whose middle does is only warned of, because the rest may have material. path: as in
 * reconstruct_examine, which has accepted them. Errors of reading. */
status noise_refuse_early(const char *const *path, size_t n_path, const struct reconstruct_option *o,
                          const struct warning_sink *warn, struct error *err);

#endif
