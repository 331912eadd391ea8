/* selvedge init FOLDER: writes the job document of a folder's files, by guesses that are shown. */
#include "clients/cli/batch/folder_kinds.h"
#include "clients/cli/commands/cli.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_ROOM = 4096, NAME_ROOM = 256 };

struct init {
    const struct cli_args *args;
    FILE *out; /* for what is shown; NULL: nothing is */
    char folder[PATH_ROOM], path[PATH_ROOM + 16];
    struct folder_kinds kinds;
    json_t *document;
};

/* The only file of a kind. NULL: there is none. */
static status only_file(const struct init *i, enum file_kind kind, const char **name, struct error *err)
{
    const size_t n = folder_kinds_count(&i->kinds, kind, name);
    if (n <= 1) {
        if (n == 0) *name = NULL;
        return STATUS_OK;
    }
    return error_set(err, STATUS_INVALID,
                     "the folder has %zu files that may be the %s, such as '%s': leave the right one, or write the "
                     "document by hand",
                     n, file_kind_name[kind], *name);
}

static void put_file(struct init *i, const char *section, const char *key, const char *name)
{
    json_t *object = json_object_get(i->document, section);
    if (object == NULL) {
        object = json_object();
        json_object_set_new(i->document, section, object);
        object = json_object_get(i->document, section);
    }
    json_object_set_new(object, key, json_string(name));
}

/* The scan: one file with its data, or all scan files of the folder as slices. */
static status add_scan(struct init *i, struct error *err)
{
    const char *name = NULL;
    char folder[PATH_ROOM], path[PATH_ROOM + NAME_ROOM];
    const size_t n = folder_kinds_count(&i->kinds, FILE_SCAN, &name);
    json_t *files = json_array(), *voxel = NULL;
    status s = STATUS_OK;
    if (n == 1) {
        snprintf(path, sizeof path, "%s/%s", i->folder, name);
        s = cli_scan_files(path, files, folder, sizeof folder, err);
    }
    for (size_t k = 0; n > 1 && k < i->kinds.files.n; k++)
        if (i->kinds.kind[k] == FILE_SCAN) json_array_append_new(files, json_string(i->kinds.files.name[k]));
    if (s == STATUS_OK && i->args->voxel_um != NULL) s = cli_scan_voxel(i->args->voxel_um, &voxel, err);
    json_t *volume = json_pack("{s:o}", "files", files);
    if (voxel != NULL) json_object_set_new(volume, "voxel_size_um", voxel);
    json_object_set_new(i->document, "volume", volume);
    return s;
}

/* What the cloth is: a scan, fibers, a draft, or a weave by name. */
static status add_cloth(struct init *i, struct error *err)
{
    const char *fibers, *draft;
    status s = only_file(i, FILE_FIBERS, &fibers, err);
    if (s == STATUS_OK) s = only_file(i, FILE_DRAFT, &draft, err);
    if (s != STATUS_OK) return s;
    const size_t n_scan = folder_kinds_count(&i->kinds, FILE_SCAN, NULL);
    const int n = (n_scan > 0) + (fibers != NULL) + (draft != NULL) + (i->args->weave != NULL);
    if (n > 1)
        return error_set(err, STATUS_INVALID,
                         "the cloth is given more than once (scan, fibers, draft, --weave): leave one of them");
    if (n_scan > 0) return add_scan(i, err);
    if (fibers != NULL) put_file(i, "fibers", "file", fibers);
    if (draft != NULL) put_file(i, "cloth", "draft_file", draft);
    if (i->args->weave != NULL) put_file(i, "cloth", "weave", i->args->weave);
    if (n == 0)
        return error_set(err, STATUS_INVALID,
                         "the folder has no scan, no file of fibers and no draft: say what the cloth is, such as "
                         "--weave plain");
    return STATUS_OK;
}

static bool is_same_view(const struct name_angles *a, const struct name_angles *b)
{
    for (int k = 0; k < NAME_N_ANGLE; k++)
        if (a->given[k] != b->given[k] || fabs(a->deg[k] - b->deg[k]) > 1e-9) return false;
    return true;
}

static void set_angle(json_t *photograph, enum name_angle which, double deg)
{
    json_object_set_new(photograph, name_angle_key[which],
                        deg == floor(deg) ? json_integer((json_int_t)deg) : json_real(deg));
}

/* Angles of a photograph: what its name does not say is 0, straight above. */
static void set_angles(json_t *photograph, const struct name_angles *a)
{
    for (int k = 0; k < NAME_N_ANGLE; k++)
        if (a->given[k] || k != NAME_ROTATION) set_angle(photograph, (enum name_angle)k, a->deg[k]);
}

/* Adds a photograph, or another exposure of the view before it. */
static void add_photograph(struct init *i, json_t *list, const char *name, struct name_angles *last)
{
    char stem[NAME_ROOM];
    struct name_angles a = {0};
    file_stem(name, stem, sizeof stem);
    const bool has_angles = i->kinds.pattern != NULL && name_angles_read(i->kinds.pattern, stem, &a);
    json_t *before = json_array_get(list, json_array_size(list) - 1);
    if (has_angles && before != NULL && is_same_view(&a, last)) {
        json_t *more = json_object_get(before, "more_exposures");
        if (more == NULL) {
            json_object_set_new(before, "more_exposures", json_array());
            more = json_object_get(before, "more_exposures");
        }
        json_array_append_new(more, json_pack("{s:s}", "file", name));
        return;
    }
    json_t *photograph = json_pack("{s:s}", "file", name);
    if (json_object_get(json_object_get(i->kinds.rig, "views"), stem) != NULL)
        json_object_set_new(photograph, "view", json_string(stem));
    else if (has_angles)
        set_angles(photograph, &a);
    *last = a;
    json_array_append_new(list, photograph);
}

static void add_photographs(struct init *i)
{
    struct name_angles last = {0};
    json_t *list = json_array(), *dark = json_array();
    for (size_t k = 0; k < i->kinds.files.n; k++) {
        if (i->kinds.kind[k] == FILE_PHOTOGRAPH) add_photograph(i, list, i->kinds.files.name[k], &last);
        if (i->kinds.kind[k] == FILE_DARK) json_array_append_new(dark, json_string(i->kinds.files.name[k]));
    }
    if (json_array_size(list) > 0) json_object_set(i->document, "photographs", list);
    if (json_array_size(list) > 0 && json_array_size(dark) > 0)
        json_object_set_new(i->document, "camera", json_pack("{s:O}", "dark_frames", dark));
    json_decref(list);
    json_decref(dark);
}

/* Tables, and what belongs to photographs. */
static status add_measurements(struct init *i, struct error *err)
{
    const char *table, *rig, *noise, *chart, *white;
    status s = only_file(i, FILE_TABLE, &table, err);
    if (s == STATUS_OK) s = only_file(i, FILE_RIG, &rig, err);
    if (s == STATUS_OK) s = only_file(i, FILE_CAMERA_NOISE, &noise, err);
    if (s == STATUS_OK) s = only_file(i, FILE_CHART, &chart, err);
    if (s == STATUS_OK) s = only_file(i, FILE_WHITE, &white, err);
    if (s != STATUS_OK) return s;
    const char *const for_photographs[] = {rig, noise, chart, white};
    const bool photographed = folder_kinds_count(&i->kinds, FILE_PHOTOGRAPH, NULL) > 0;
    if (photographed && table != NULL)
        return error_set(err, STATUS_INVALID,
                         "the folder has photographs and the table '%s', but a job takes one of both: move one away",
                         table);
    if (table != NULL) put_file(i, "measurements", "file", table);
    add_photographs(i);
    if (photographed && rig != NULL) put_file(i, "rig", "file", rig);
    if (photographed && noise != NULL) put_file(i, "camera", "noise_file", noise);
    if (photographed && chart != NULL)
        json_object_set_new(i->document, "color", json_pack("{s:{s:s}}", "chart", "file", chart));
    else if (photographed && white != NULL)
        json_object_set_new(i->document, "color", json_pack("{s:{s:s}}", "white", "file", white));
    if (i->out == NULL) return STATUS_OK;
    if (photographed && chart != NULL && white != NULL)
        fprintf(i->out, "not used: '%s', because the color chart gives the scale\n", white);
    for (size_t n = 0; !photographed && n < sizeof for_photographs / sizeof *for_photographs; n++)
        if (for_photographs[n] != NULL)
            fprintf(i->out, "not used: '%s', because there are no photographs\n", for_photographs[n]);
    return STATUS_OK;
}

static void show_files(const struct init *i, FILE *out)
{
    int width = 8;
    for (size_t k = 0; k < i->kinds.files.n; k++) {
        const int n = (int)strlen(i->kinds.files.name[k]);
        if (n > width) width = n < 48 ? n : 48;
    }
    for (size_t k = 0; k < i->kinds.files.n; k++)
        fprintf(out, "  %-*s  %s\n", width, i->kinds.files.name[k], file_kind_name[i->kinds.kind[k]]);
    if (folder_kinds_count(&i->kinds, FILE_PHOTOGRAPH, NULL) == 0) return;
    if (i->kinds.pattern != NULL)
        fprintf(out, "angles in the names of photographs: %s (--names changes it; what a name does not say is 0)\n",
                i->kinds.pattern);
    else if (i->kinds.rig == NULL)
        fprintf(out, "the names of the photographs do not tell their angles: give --names, such as "
                     "--names \"t{light_theta}_p{light_phi}\", or a file of the rig (docs/photographs.md)\n");
}

static status write_document(const struct init *i, struct error *err)
{
    FILE *f = fopen(i->path, "we");
    if (f == NULL) return error_set_errno(err, "cannot write '%s'", i->path);
    const bool wrote = json_dumpf(i->document, f, JSON_INDENT(2) | JSON_PRESERVE_ORDER) == 0 && fputc('\n', f) != EOF;
    return fclose(f) == 0 && wrote ? STATUS_OK : error_set(err, STATUS_IO, "cannot write '%s'", i->path);
}

/* The name of the folder, also where it is given as "." or with a slash at its end. */
static status start(struct init *i, struct error *err)
{
    struct stat st;
    const char *given = i->args->operand;
    if (realpath(given, i->folder) == NULL || stat(i->folder, &st) != 0)
        return error_set_errno(err, "cannot read the folder '%s'", given);
    if (!S_ISDIR(st.st_mode)) return error_set(err, STATUS_INVALID, "'%s' is no folder", given);
    snprintf(i->path, sizeof i->path, "%s/%s", i->folder, SAMPLE_DOCUMENT);
    return STATUS_OK;
}

/* Looks at the files and makes the document. */
static status make_document(struct init *i, struct error *err)
{
    const char *slash = strrchr(i->folder, '/');
    i->document = json_pack("{s:s}", "sample", slash[1] != '\0' ? slash + 1 : "sample");
    if (i->document == NULL)
        return error_set(err, STATUS_INVALID, "the name of the folder '%s' is not UTF-8: rename it", i->folder);
    status s = folder_kinds_guess(i->folder, i->args->names, &i->kinds, err);
    if (s == STATUS_OK && i->out != NULL) show_files(i, i->out);
    if (s == STATUS_OK) s = add_cloth(i, err);
    return s == STATUS_OK ? add_measurements(i, err) : s;
}

/* A document that is there is replaced if it says no more than an earlier `init` without options wrote. */
static status check_old(const struct init *i, struct error *err)
{
    struct cli_args bare = *i->args;
    struct init before = {.args = &bare};
    json_t *old = json_load_file(i->path, 0, NULL);
    if (old == NULL && access(i->path, F_OK) != 0) return STATUS_OK;
    bare.names = bare.voxel_um = NULL;
    snprintf(before.folder, sizeof before.folder, "%s", i->folder);
    const bool is_own = json_equal(old, i->document) != 0 ||
                        (make_document(&before, NULL) == STATUS_OK && json_equal(old, before.document) != 0);
    json_decref(old);
    json_decref(before.document);
    folder_kinds_release(&before.kinds);
    if (is_own) return STATUS_OK;
    return error_set(err, STATUS_CONFLICT,
                     "'%s' exists and was changed by hand: `selvedge check` looks at it; move it away to begin anew",
                     i->path);
}

CLI_COMMAND(
    INIT, cli_init, .place = 5, .name = "init", .operand = "FOLDER", .needs = "a folder with the files of a sample",
    .options = "names weave voxel-um", .summary = "write the job document of a folder's files, without a server",
    .text = "Each file is shown with the use that its name suggests: scan or slices, table, photographs, dark frames,\n"
            "color chart, fibers, draft, rig. Angles come from the rig's views or from the names of photographs\n"
            "(t45_p180.dng). Photographs with the same angles are exposures of one view. Then the document\n"
            "FOLDER/job.json is written and checked. Exit status 1 when something has to be added or mended.\n")

status cli_init(struct cli *cli, int *exit_code, struct error *err)
{
    struct init i = {.args = cli->args, .out = cli->out};
    size_t n_fault = 0;
    status s = start(&i, err);
    if (s == STATUS_OK) s = make_document(&i, err);
    if (s == STATUS_OK) s = check_old(&i, err);
    if (s == STATUS_OK) s = write_document(&i, err);
    if (s == STATUS_OK) {
        fprintf(cli->out, "written: %s\n", i.path);
        s = cli_check_document(i.path, i.folder, cli->out, &n_fault, err);
    }
    if (s == STATUS_OK && n_fault == 0)
        fprintf(cli->out, "send it with: selvedge submit %s --watch\n", i.path);
    else if (s == STATUS_OK)
        fprintf(cli->out,
                "add what is missing: `selvedge init` again with --voxel-um, --weave or --names, or by hand in %s\n"
                "(docs/options.md); then: selvedge check %s\n",
                i.path, i.path);
    if (n_fault > 0) *exit_code = CLI_EXIT_ERROR;
    json_decref(i.document);
    folder_kinds_release(&i.kinds);
    return s;
}
