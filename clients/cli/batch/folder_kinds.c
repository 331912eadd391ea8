#include "clients/cli/batch/folder_kinds.h"

#include "base/catalogue/volume_format.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_ROOM = 4096, NAME_ROOM = 256 };

const char *const file_kind_name[FILE_N_KIND] = {"not used",
                                                 "scan",
                                                 "data of the scan",
                                                 "table of reflectances",
                                                 "photograph",
                                                 "color chart",
                                                 "white card",
                                                 "dark frame",
                                                 "flat frame, not used by a job: `selvedge calibrate-camera`",
                                                 "fibers",
                                                 "draft",
                                                 "rig",
                                                 "camera's noise",
                                                 "job document"};

/* Endings of names, between blanks. A TIFF file may be a scan or a photograph. */
static const struct {
    const char *endings;
    enum file_kind kind;
} by_ending[] = {
    {" dng cr2 cr3 nef arw orf rw2 raf pef jpg jpeg png exr tif tiff ", FILE_PHOTOGRAPH},
    {" csv tsv binary bsdf astm ", FILE_TABLE},
    {" hair ", FILE_FIBERS},
    {" wif ", FILE_DRAFT},
};
/* Words in the names of pictures that do not show the cloth. */
static const struct {
    const char *word;
    enum file_kind kind;
} by_word[] = {{"dark", FILE_DARK},          {"flat", FILE_FLAT},   {"chart", FILE_CHART},
               {"colorchecker", FILE_CHART}, {"white", FILE_WHITE}, {"grey", FILE_WHITE}};

static void lower(const char *name, char *out)
{
    size_t n = 0;
    for (; name[n] != '\0' && n + 1 < NAME_ROOM; n++) out[n] = (char)tolower((unsigned char)name[n]);
    out[n] = '\0';
}

void file_stem(const char *name, char *stem, size_t n_bytes)
{
    const char *dot = strrchr(name, '.');
    snprintf(stem, n_bytes, "%.*s", (int)(dot != NULL && dot != name ? (size_t)(dot - name) : strlen(name)), name);
}

static enum file_kind kind_of_ending(const char *name)
{
    char small[NAME_ROOM], ending[24];
    lower(name, small);
    const char *dot = strrchr(small, '.');
    if (dot == NULL || strlen(dot) > 12) return FILE_UNKNOWN;
    snprintf(ending, sizeof ending, " %s ", dot + 1);
    for (size_t i = 0; i < sizeof by_ending / sizeof *by_ending; i++)
        if (strstr(by_ending[i].endings, ending) != NULL) return by_ending[i].kind;
    return FILE_UNKNOWN;
}

static enum file_kind kind_of_json(const char *folder, const char *name, struct folder_kinds *k)
{
    char path[PATH_ROOM];
    enum file_kind kind = FILE_UNKNOWN;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    json_t *json = json_load_file(path, 0, NULL);
    if (json_object_get(json, "selvedge_rig") != NULL)
        kind = FILE_RIG;
    else if (json_object_get(json, "selvedge_camera_noise") != NULL)
        kind = FILE_CAMERA_NOISE;
    else if (json_object_get(json, "sample") != NULL)
        kind = FILE_DOCUMENT;
    if (kind == FILE_RIG && k->rig == NULL)
        k->rig = json;
    else
        json_decref(json);
    return kind;
}

static bool ends_in(const char *name, const char *ending)
{
    const size_t n = strlen(name), n_ending = strlen(ending);
    return n > n_ending && strcmp(name + n - n_ending, ending) == 0;
}

/* A picture is a photograph of the cloth if its name has angles or a view of the rig. */
static bool is_named_as_photograph(const struct folder_kinds *k, const char *name, const char *pattern)
{
    char stem[NAME_ROOM];
    struct name_angles a;
    const char *one[1] = {stem};
    file_stem(name, stem, sizeof stem);
    if (json_object_get(json_object_get(k->rig, "views"), stem) != NULL) return true;
    return pattern != NULL ? name_angles_read(pattern, stem, &a) : name_angles_guess(one, 1) != NULL;
}

static enum file_kind kind_of(const struct folder_kinds *k, const char *name, const char *pattern)
{
    char small[NAME_ROOM];
    const enum file_kind kind = kind_of_ending(name);
    lower(name, small);
    const bool is_tiff = ends_in(small, ".tif") || ends_in(small, ".tiff");
    if (kind == FILE_PHOTOGRAPH) {
        /* first, because the cloth may be dark or white */
        if (is_named_as_photograph(k, name, pattern)) return FILE_PHOTOGRAPH;
        for (size_t i = 0; i < sizeof by_word / sizeof *by_word; i++)
            if (strstr(small, by_word[i].word) != NULL) return by_word[i].kind;
        if (!is_tiff) return FILE_PHOTOGRAPH;
    } else if (kind != FILE_UNKNOWN) {
        return kind;
    }
    return volume_format_of(name) != NULL ? FILE_SCAN : FILE_UNKNOWN;
}

/* Samples beside a header are not a scan of their own. */
static void settle_scans(struct folder_kinds *k)
{
    size_t n_header = 0;
    for (size_t i = 0; i < k->files.n; i++)
        n_header +=
            k->kind[i] == FILE_SCAN && volume_format_is_header(volume_format_of(k->files.name[i]), k->files.name[i]);
    for (size_t i = 0; i < k->files.n; i++) {
        char small[NAME_ROOM];
        lower(k->files.name[i], small);
        const bool is_data = ends_in(small, ".raw") || ends_in(small, ".img") || ends_in(small, ".zraw") ||
                             ends_in(small, ".raw.gz") || ends_in(small, ".bin");
        if (n_header > 0 && is_data) k->kind[i] = FILE_SCAN_DATA;
    }
}

static status guess_pattern(struct folder_kinds *k, struct error *err)
{
    const char **stems = calloc(k->files.n + 1, sizeof *stems);
    char(*room)[NAME_ROOM] = calloc(k->files.n + 1, sizeof *room);
    size_t n = 0;
    for (size_t i = 0; stems != NULL && room != NULL && i < k->files.n; i++) {
        if (k->kind[i] != FILE_PHOTOGRAPH) continue;
        file_stem(k->files.name[i], room[n], sizeof room[n]);
        stems[n] = room[n];
        n++;
    }
    const bool ok = stems != NULL && room != NULL;
    if (ok) k->pattern = name_angles_guess(stems, n);
    free(stems);
    free(room);
    return ok ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot look at the folder: out of memory");
}

status folder_kinds_guess(const char *folder, const char *pattern, struct folder_kinds *k, struct error *err)
{
    *k = (struct folder_kinds){.pattern = pattern};
    status s = pattern != NULL ? name_angles_check(pattern, err) : STATUS_OK;
    if (s == STATUS_OK) s = sample_files_list(folder, "", &k->files, err);
    if (s != STATUS_OK) return s;
    k->kind = calloc(k->files.n + 1, sizeof *k->kind);
    if (k->kind == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look at the folder: out of memory");
    for (size_t i = 0; i < k->files.n; i++)
        if (ends_in(k->files.name[i], ".json")) k->kind[i] = kind_of_json(folder, k->files.name[i], k);
    for (size_t i = 0; i < k->files.n; i++)
        if (!ends_in(k->files.name[i], ".json")) k->kind[i] = kind_of(k, k->files.name[i], pattern);
    settle_scans(k);
    return pattern == NULL ? guess_pattern(k, err) : STATUS_OK;
}

void folder_kinds_release(struct folder_kinds *k)
{
    sample_files_release(&k->files);
    free(k->kind);
    json_decref(k->rig);
    *k = (struct folder_kinds){0};
}

size_t folder_kinds_count(const struct folder_kinds *k, enum file_kind kind, const char **first)
{
    size_t n = 0;
    for (size_t i = 0; i < k->files.n; i++) {
        if (k->kind[i] != kind) continue;
        if (n == 0 && first != NULL) *first = k->files.name[i];
        n++;
    }
    return n;
}
