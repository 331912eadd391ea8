/* Reads foreign files as the worker does, and prints what it found: one JSON object for each line of standard input.
 *
 *   scan PATH CHANNEL TIME DATASET [PATH ...]
 *       a scan of one or more files; channel and time count from 1, 0: not chosen
 *   photograph PATH TRANSFER
 *       TRANSFER: "linear" or "srgb", or "file" for the curve that the file states
 *
 * Samples go to PATH.values as 32-bit floats in the order of the file: slices, rows and columns of a scan, and rows,
 * columns and three channels of a photograph. A file that is refused gives {"refused": MESSAGE}. tests/zoo/zoo.py
 * compares the answers with values of other programs. */
#include "base/files/file_ledger.h"
#include "geometry/volume/format/volume_source.h"
#include "optimizer/photographs/reader/photograph_reader.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PIXELS = 1 << 22, PATH_BYTES = 4000, MOST_PATHS = 64 };

static json_t *ledger_json(const struct file_ledger *ledger)
{
    json_t *list = json_array();
    for (size_t i = 0; i < ledger->n; i++) {
        const struct file_statement *s = &ledger->item[i];
        json_array_append_new(list, json_pack("{s:s, s:s, s:s, s:s}", "name", s->name, "value", s->value, "use",
                                              file_statement_use_name(s->use), "reason", s->reason));
    }
    return list;
}

/* Writes PATH.values. Returns false, with a message on standard error, when that fails. */
static bool write_values(const char *path, const float *value, size_t n)
{
    char name[PATH_BYTES + 16];
    snprintf(name, sizeof name, "%s.values", path);
    FILE *f = fopen(name, "wb");
    const bool written = f != NULL && fwrite(value, sizeof *value, n, f) == n;
    if ((f != NULL && fclose(f) != 0) || !written) {
        fprintf(stderr, "cannot write %s\n", name);
        return false;
    }
    return true;
}

static json_t *refusal(const struct error *err) { return json_pack("{s:s}", "refused", err->text); }

/* JSON has no NaN: a number that is not stated is null. */
static json_t *number(double x) { return isfinite(x) ? json_real(x) : json_null(); }

static json_t *read_scan(const char *const *paths, size_t n_path, const struct volume_part *part)
{
    const char *path = paths[0];
    struct volume_source *source = NULL;
    struct error err = {0};
    if (volume_source_open_declared(paths, n_path, NULL, part, &source, &err) != STATUS_OK) return refusal(&err);
    const struct volume_source_info *info = volume_source_describe(source);
    const size_t n = info->n[0] * info->n[1] * info->n[2];
    float *value = n <= MOST_PIXELS ? malloc((n + 1) * sizeof *value) : NULL;
    json_t *said;
    if (value == NULL)
        said = json_pack("{s:s}", "refused", "too large for the zoo");
    else if (volume_source_read(source, 0, info->n[2], value, &err) != STATUS_OK)
        said = refusal(&err);
    else {
        write_values(path, value, n);
        said = json_pack("{s:[i,i,i], s:[o,o,o], s:s, s:b, s:o, s:s, s:o}", "size", (int)info->n[0], (int)info->n[1],
                         (int)info->n[2], "voxel_size_um", number(info->voxel_size_m[0] * 1e6),
                         number(info->voxel_size_m[1] * 1e6), number(info->voxel_size_m[2] * 1e6), "axes", info->axes,
                         "oblique", info->is_oblique, "padding", number(info->padding), "sample", info->sample, "files",
                         ledger_json(&info->ledger));
    }
    free(value);
    volume_source_close(source);
    return said;
}

static json_t *read_photograph(const char *path, const char *transfer)
{
    const bool of_file = strcmp(transfer, "file") == 0;
    const bool linear = strcmp(transfer, "linear") == 0;
    const struct photograph_request request = {.transfer_assumed = of_file,
                                               .transfer = linear ? JOB_TRANSFER_LINEAR : JOB_TRANSFER_SRGB,
                                               .black_level = NAN,
                                               .limit_pixel = MOST_PIXELS};
    struct photograph_info info = {0};
    struct image im = {0};
    struct error err = {0};
    if (photograph_file_read(path, &request, &im, &info, &err) != STATUS_OK) return refusal(&err);
    write_values(path, im.pixel, im.width * im.height * 3);
    json_t *said = json_pack("{s:[i,i], s:o, s:o, s:o, s:o, s:i, s:i, s:b, s:b, s:o}", "size", (int)im.width,
                             (int)im.height, "saturation", number(photograph_saturation(&info)), "exposure_s",
                             number(info.exposure_s), "iso", number(info.iso), "aperture", number(info.aperture),
                             "bits", (int)info.bits, "orientation", (int)info.orientation, "curve_of_file",
                             info.curve_of_file, "alpha", info.has_alpha, "files", ledger_json(&info.ledger));
    image_release(&im);
    return said;
}

/* Fields of a line lie between tabulators, because names may have blanks. */
static json_t *answer(char *line)
{
    char *rest = line;
    const char *kind = strsep(&rest, "\t"), *path[MOST_PATHS] = {strsep(&rest, "\t")}, *third = strsep(&rest, "\t");
    if (path[0] == NULL || third == NULL || strlen(path[0]) >= PATH_BYTES) return NULL;
    if (strcmp(kind, "photograph") == 0) return read_photograph(path[0], third);
    const char *time = strsep(&rest, "\t"), *dataset = strsep(&rest, "\t");
    if (strcmp(kind, "scan") != 0 || dataset == NULL) return NULL;
    size_t n = 1;
    while (rest != NULL && n < MOST_PATHS) path[n++] = strsep(&rest, "\t");
    struct volume_part part = {.channel = strtoul(third, NULL, 10), .time = strtoul(time, NULL, 10)};
    snprintf(part.dataset, sizeof part.dataset, "%s", dataset);
    return read_scan(path, n, &part);
}

int main(void)
{
    char *line = NULL;
    size_t room = 0;
    while (getline(&line, &room, stdin) > 0) {
        line[strcspn(line, "\n")] = '\0';
        json_t *said = answer(line);
        char *text = said != NULL ? json_dumps(said, JSON_COMPACT | JSON_ENCODE_ANY) : NULL;
        if (text == NULL) {
            fprintf(stderr, "no answer to this line: %s\n", line);
            return 2;
        }
        puts(text);
        fflush(stdout);
        free(text);
        json_decref(said);
    }
    free(line);
    return 0;
}
