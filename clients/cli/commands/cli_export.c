/* selvedge export and selvedge twin: files for other programs, and the twin for a browser, of a finished job. */
#include "clients/cli/commands/cli_derive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Reads "mitsuba,usd" as {"mitsuba": true, "usd": true}. */
static status read_formats(const char *text, json_t **formats, struct error *err)
{
    static const char *const known[] = {
#define EXPORT(name, ...) #name,
#include "generated/exports.def"
#undef EXPORT
        "pdf"};
    char list[256] = "";
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        const size_t n = strlen(list);
        snprintf(list + n, sizeof list - n, "%s%s", i == 0 ? "" : ", ", known[i]);
    }
    if (text == NULL)
        return error_set(err, STATUS_INVALID, "option '--to' is missing: give a format (%s), or several with commas",
                         list);
    *formats = json_object();
    while (*text != '\0') {
        const size_t n = strcspn(text, ",");
        bool is_known = false;
        for (size_t i = 0; i < sizeof known / sizeof *known; i++)
            is_known = is_known || (strlen(known[i]) == n && strncmp(known[i], text, n) == 0);
        if (!is_known)
            return error_set(err, STATUS_INVALID, "option '--to' takes formats out of %s: '%.*s'", list, (int)n, text);
        json_object_setn_new(*formats, text, n, json_true());
        text += n + (text[n] == ',');
    }
    return STATUS_OK;
}

/* Adds a number of the command line to the section, for the checks of the job document. */
static status add_number(json_t *section, const char *key, const char *option, const char *text, struct error *err)
{
    char *end;
    if (text == NULL) return STATUS_OK;
    const double value = strtod(text, &end);
    if (end == text || *end != '\0')
        return error_set(err, STATUS_INVALID, "option '%s' takes a number: '%s'", option, text);
    const bool is_whole = value == floor(value) && fabs(value) < 1e9;
    json_object_set_new(section, key, is_whole ? json_integer((json_int_t)value) : json_real(value));
    return STATUS_OK;
}

/* The PDF lies beside the folder of exports, which is not there without another format. */
static bool only_pdf(const json_t *wanted)
{
    const json_t *formats = json_object_get(wanted, "export");
    return json_object_size(formats) == 1 && json_object_get(formats, "pdf") != NULL;
}

static bool is_folder(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

/* Makes the results of a job, and downloads those whose paths begin with prefix. */
static status make_and_fetch(struct cli *cli, const char *text, const json_t *wanted, const char *prefix,
                             int *exit_code, struct error *err)
{
    char id[CLI_ID_BYTES], made[CLI_ID_BYTES];
    status s = cli_whole_id(cli, text, id, err);
    if (s == STATUS_OK) s = cli_derive(cli, id, wanted, NULL, made, exit_code, err);
    return s == STATUS_OK && *exit_code == CLI_EXIT_OK ? cli_fetch_results(cli, made, prefix, err) : s;
}

CLI_COMMAND(
    EXPORT, cli_export, .place = 42, .name = "export", .operand = "ID|FOLDER",
    .needs = "a job id, or a folder of downloaded results", .options = "to texture-cm texture-px out id-file",
    .summary = "the cloth of a finished job for other programs, without a new fit",
    .text =
        "A job of its own writes the files, which go to export/FORMAT in the folder of --out (default: selvedge-ID).\n"
        "Of a FOLDER of downloaded results selvedge-worker writes them on this machine, into the folder itself.\n")

status cli_export(struct cli *cli, int *exit_code, struct error *err)
{
    json_t *formats = NULL;
    status s = read_formats(cli->args->to, &formats, err);
    if (s == STATUS_OK) s = add_number(formats, "texture_cm", "--texture-cm", cli->args->texture_cm, err);
    if (s == STATUS_OK) s = add_number(formats, "texture_px", "--texture-px", cli->args->texture_px, err);
    json_t *wanted = json_pack("{s:o}", "export", formats != NULL ? formats : json_object());
    const char *from = cli->args->operand, *to = cli->args->out_dir != NULL ? cli->args->out_dir : from;
    if (s == STATUS_OK)
        s = is_folder(from)
                ? cli_export_folder(cli, from, wanted, to, err)
                : make_and_fetch(cli, from, wanted, only_pdf(wanted) ? "report.pdf" : "export/", exit_code, err);
    json_decref(wanted);
    return s;
}

CLI_COMMAND(
    TWIN, cli_twin, .place = 44, .name = "twin", .operand = "ID", .options = "out id-file",
    .summary = "the cloth of a finished job to turn with the mouse, without a new fit",
    .text =
        "A job of its own makes the tables, in one to three minutes of a processor; the page of that job shows the\n"
        "cloth. They go to twin/ in the folder of --out (default: selvedge-ID).\n")

status cli_twin(struct cli *cli, int *exit_code, struct error *err)
{
    json_t *wanted = json_pack("{s:{s:b}}", "twin", "make", 1);
    status s = make_and_fetch(cli, cli->args->operand, wanted, "twin/", exit_code, err);
    json_decref(wanted);
    return s;
}
