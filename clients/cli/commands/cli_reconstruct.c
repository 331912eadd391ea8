/* selvedge reconstruct SCAN: a job of geometry only, for one who has a scan and wants its fibers. */
#include "base/catalogue/volume_format.h"
#include "base/natural_order.h"
#include "clients/cli/commands/cli.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

static const char *name_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

/* Lists the slices in a folder, in the order of the numbers in their names. */
static status list_slices(const char *folder, json_t *files, struct error *err)
{
    DIR *d = opendir(folder);
    if (d == NULL) return error_set_errno(err, "cannot read the folder '%s'", folder);
    char **name = NULL;
    size_t n = 0;
    bool ok = true;
    for (struct dirent *e; ok && (e = readdir(d)) != NULL;) {
        const struct volume_format *format = volume_format_of(e->d_name);
        if (e->d_name[0] == '.' || format == NULL || !format->may_be_slices) continue;
        char **more = realloc(name, (n + 1) * sizeof *name);
        ok = more != NULL;
        if (ok) name = more;
        if (ok) ok = (name[n] = strdup(e->d_name)) != NULL;
        n += ok;
    }
    closedir(d);
    if (n > 0) qsort(name, n, sizeof *name, natural_compare_names);
    status s = STATUS_OK;
    for (size_t i = 0; i < n; i++) {
        if (json_array_append_new(files, json_string(name[i])) != 0)
            s = error_set(err, STATUS_INVALID, "the name of the file '%s' is not UTF-8: rename it", name[i]);
        free(name[i]);
    }
    free(name);
    if (s != STATUS_OK) return s;
    if (!ok) return error_set(err, STATUS_NO_MEMORY, "cannot list the folder '%s': out of memory", folder);
    return n > 0 ? STATUS_OK : error_set(err, STATUS_NOT_FOUND, "the folder '%s' has no TIFF or DICOM files", folder);
}

/* Whether the first n characters of the line are a key of the format, whatever the case. */
static bool names_data_file(const struct volume_format *format, const char *line, size_t n)
{
    while (n > 0 && (line[n - 1] == ' ' || line[n - 1] == '\t')) n--;
    for (size_t i = 0; i < VOLUME_MAX_KEY && format->data_key[i] != NULL; i++)
        if (strlen(format->data_key[i]) == n && strncasecmp(line, format->data_key[i], n) == 0) return true;
    return false;
}

/* Adds the data file that a header names. LOCAL: the data is in the header's own file. */
static status add_data_file(const char *path, const struct volume_format *format, json_t *files, struct error *err)
{
    char line[1024];
    FILE *f = fopen(path, "re");
    bool found = false;
    if (f == NULL) return error_set_errno(err, "cannot read the scan '%s'", path);
    while (!found && fgets(line, sizeof line, f) != NULL) {
        char *value = strchr(line, format->separator);
        if (value == NULL || !names_data_file(format, line, (size_t)(value - line))) continue;
        value += 1 + strspn(value + 1, " \t");
        value[strcspn(value, "\r\n")] = '\0';
        found = value[0] != '\0';
        if (found && strcasecmp(value, "LOCAL") != 0) json_array_append_new(files, json_string(value));
    }
    fclose(f);
    return found ? STATUS_OK : error_set(err, STATUS_FORMAT, "the scan '%s' does not name its data file", path);
}

/* Adds the data file that has the name of its header and another ending, in capital letters like the header's. */
static status add_data_beside(const char *path, const struct volume_format *format, json_t *files, struct error *err)
{
    const char *name = name_of(path);
    const size_t stem = strlen(name) - strlen(format->header_ending);
    const bool capital = isupper((unsigned char)name[stem + 1]);
    char data[NAME_MAX + 16];
    snprintf(data, sizeof data, "%.*s%s", (int)stem, name, format->data_ending);
    for (char *c = data + stem; capital && *c != '\0'; c++) *c = (char)toupper((unsigned char)*c);
    return json_array_append_new(files, json_string(data)) == 0
               ? STATUS_OK
               : error_set(err, STATUS_INVALID, "the name of the file '%s' is not UTF-8: rename it", data);
}

status cli_scan_files(const char *scan, json_t *files, char *folder, size_t n_bytes, struct error *err)
{
    struct stat st;
    if (stat(scan, &st) != 0) return error_set_errno(err, "cannot read the scan '%s'", scan);
    if (S_ISDIR(st.st_mode)) {
        snprintf(folder, n_bytes, "%s", scan);
        return list_slices(scan, files, err);
    }
    cli_folder_of(scan, folder, n_bytes);
    json_array_append_new(files, json_string(name_of(scan)));
    const struct volume_format *format = volume_format_of(scan);
    if (format == NULL || !volume_format_is_header(format, scan)) return STATUS_OK;
    return format->data_ending != NULL ? add_data_beside(scan, format, files, err)
                                       : add_data_file(scan, format, files, err);
}

status cli_scan_voxel(const char *text, json_t **voxel, struct error *err)
{
    double um[3];
    char *end = NULL;
    int n = 0;
    bool valid = true;
    const char *at = text;
    do {
        um[n] = strtod(at, &end);
        valid = end != at && um[n] > 0.0 && isfinite(um[n]);
        at = end + 1;
        n++;
    } while (valid && n < 3 && *end == ',');
    if (!valid || n == 2 || *end != '\0')
        return error_set(err, STATUS_INVALID, "option '--voxel-um' takes one length or three, such as 2 or 2,2,3: '%s'",
                         text);
    *voxel = n == 1 ? json_real(um[0]) : json_pack("[f, f, f]", um[0], um[1], um[2]);
    return STATUS_OK;
}

/* Writes the kind of fibers and the questions to the scan into `volume`. */
static status add_fibers(const struct cli_args *a, json_t *volume, struct error *err)
{
    const bool hollow = a->hollow != NULL && strcmp(a->hollow, "yes") == 0;
    if (a->hollow != NULL && !hollow && strcmp(a->hollow, "no") != 0)
        return error_set(err, STATUS_INVALID, "option '--hollow' takes yes or no: '%s'", a->hollow);
    if (a->hollow != NULL) json_object_set_new(volume, "hollow_fibers", json_boolean(hollow));
    if (a->trial) json_object_set_new(volume, "trial", json_true());
    if (a->diameter_voxel == NULL) return STATUS_OK;
    char *end = NULL;
    const double voxel = strtod(a->diameter_voxel, &end);
    if (end == a->diameter_voxel || *end != '\0' || !(voxel > 0.0) || !isfinite(voxel))
        return error_set(err, STATUS_INVALID, "option '--diameter-voxel' takes a number above 0: '%s'",
                         a->diameter_voxel);
    json_object_set_new(volume, "fiber_diameter_voxel", json_real(voxel));
    return STATUS_OK;
}

static status make_document(const struct cli_args *a, json_t **document, char *folder, size_t n_bytes,
                            struct error *err)
{
    json_t *files = json_array(), *volume = json_object(), *voxel = NULL;
    status s = cli_scan_files(a->operand, files, folder, n_bytes, err);
    if (s == STATUS_OK && a->voxel_um != NULL) s = cli_scan_voxel(a->voxel_um, &voxel, err);
    json_object_set_new(volume, "files", files);
    if (voxel != NULL) json_object_set_new(volume, "voxel_size_um", voxel);
    if (a->axes != NULL) json_object_set_new(volume, "axes", json_string(a->axes));
    if (s == STATUS_OK) s = add_fibers(a, volume, err);
    if (a->align) {
        json_object_set_new(volume, "align", json_string("auto"));
        json_object_set_new(volume, "crop", json_string("auto"));
    }
    *document = json_pack("{s:s, s:o}", "sample", name_of(a->operand), "volume", volume);
    if (s == STATUS_OK && *document == NULL)
        s = error_set(err, STATUS_INVALID, "the name of the scan '%s' is not UTF-8", a->operand);
    return s;
}

CLI_COMMAND(
    RECONSTRUCT, cli_reconstruct, .place = 30, .name = "reconstruct", .operand = "SCAN", .needs = "a scan",
    .options = "scan out id-file require",
    .summary = "trace the fibers of a scan, without photographs, and download the results",
    .text =
        "SCAN is a file (" CLI_SCAN_FORMATS ") or a folder of slices. The job ends with the\n"
        "geometry; a later job goes on from it (\"geometry\": {\"job\": ID} in its document). The results go to the\n"
        "folder of --out (default: selvedge-ID).\n")

status cli_reconstruct(struct cli *cli, int *exit_code, struct error *err)
{
    json_t *document = NULL;
    char folder[4096], id[CLI_ID_BYTES] = "";
    status s = make_document(cli->args, &document, folder, sizeof folder, err);
    if (s == STATUS_OK) s = cli_submit_document(cli, document, folder, id, err);
    if (s == STATUS_OK) s = cli_watch_job(cli, id, exit_code, err);
    if (s == STATUS_OK && *exit_code == CLI_EXIT_OK) s = cli_results_to_out(cli, id, err);
    if (s != STATUS_OK && s != STATUS_CONFLICT && s != STATUS_INVALID &&
        id[0] != '\0') /* a conflict is a job that has failed */
        fprintf(cli->note, "continue with: selvedge watch %s, then selvedge results %s\n", id, id);
    json_decref(document);
    return s;
}
