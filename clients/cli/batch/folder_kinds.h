/* Guesses what the files of a sample's folder are, by their names and the first keys of JSON files. */
#ifndef SELVEDGE_CLIENTS_FOLDER_KINDS_H
#define SELVEDGE_CLIENTS_FOLDER_KINDS_H

#include "clients/cli/batch/sample_files.h"
#include "clients/cli/text/name_angles.h"

#include <jansson.h>

enum file_kind {
    FILE_UNKNOWN,
    FILE_SCAN,
    FILE_SCAN_DATA, /* samples of a scan whose header is another file */
    FILE_TABLE,
    FILE_PHOTOGRAPH,
    FILE_CHART,
    FILE_WHITE,
    FILE_DARK,
    FILE_FLAT,
    FILE_FIBERS,
    FILE_DRAFT,
    FILE_RIG,
    FILE_CAMERA_NOISE,
    FILE_DOCUMENT,
    FILE_N_KIND
};

/* "scan", "table of reflectances" and so forth. */
extern const char *const file_kind_name[FILE_N_KIND];

struct folder_kinds {
    struct sample_files files;
    enum file_kind *kind; /* files.n */
    const char *pattern;  /* of the angles in the names of photographs; NULL: none fits */
    json_t *rig;          /* the file of the rig; NULL: there is none */
};

/* Lists a folder. pattern: of the names of photographs, or NULL for the usual ones; it must outlive the result. The
 * caller releases it also after an error: STATUS_NOT_FOUND, STATUS_INVALID, STATUS_NO_MEMORY. */
status folder_kinds_guess(const char *folder, const char *pattern, struct folder_kinds *k, struct error *err);
void folder_kinds_release(struct folder_kinds *k);

/* Number of files of a kind; the first of them in *first unless it is NULL. */
size_t folder_kinds_count(const struct folder_kinds *k, enum file_kind kind, const char **first);

/* Writes the name without its ending. */
void file_stem(const char *name, char *stem, size_t n_bytes);

#endif
