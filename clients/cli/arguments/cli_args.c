#include "clients/cli/arguments/cli_args.h"
#include "clients/cli/arguments/cli_command_table.h"
#include "clients/cli/arguments/cli_option_bits.h"
#include "clients/cli/arguments/cli_tool.h"
#include "clients/cli/text/cli_text.h"

#include <getopt.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

static const struct cli_option {
    int bit;
    char letter;
    const char *name, *value, *what;
    size_t at; /* where it goes in struct cli_args: a text if it has a value, else a bool */
} option_table[] = {
    {OPT_INPUT, 0, "input-dir", "DIR", "folder of the input files (default: the document's folder)",
     offsetof(struct cli_args, input_dir)},
    {OPT_WATCH, 'w', "watch", NULL, "follow the job until it ends", offsetof(struct cli_args, watch)},
    {OPT_RESUME, 0, "resume", "ID",
     "continue an interrupted submit of job ID (JOB.json is then not needed\n"
     "                      if the files are in the current folder or --input-dir)",
     offsetof(struct cli_args, resume_id)},
    {OPT_DRAFT, 0, "draft", NULL, "upload everything but do not start the job", offsetof(struct cli_args, draft)},
    {OPT_ID_FILE, 0, "id-file", "FILE", "write the job's id to FILE as soon as there is one (for scripts)",
     offsetof(struct cli_args, id_file)},
    {OPT_SCAN, 0, "voxel-um", "UM", "edge of a voxel in micrometres, or three, such as 2,2,3 (default: the file's)",
     offsetof(struct cli_args, voxel_um)},
    {OPT_SCAN, 0, "axes", "XYZ", "which axis of the file is weft, warp and height, such as xzy (default: xyz)",
     offsetof(struct cli_args, axes)},
    {OPT_SCAN, 0, "align", NULL, "turn weft and warp to x and y, and crop to what repeats",
     offsetof(struct cli_args, align)},
    {OPT_SCAN, 0, "hollow", "yes|no", "whether the fibers are hollow, as cotton (default: decided from the scan)",
     offsetof(struct cli_args, hollow)},
    {OPT_SCAN, 0, "diameter-voxel", "N", "diameter of the fibers in voxels (default: measured)",
     offsetof(struct cli_args, diameter_voxel)},
    {OPT_SCAN, 0, "trial", NULL, "also state what such a scan can give, by a phantom of the traced fibers",
     offsetof(struct cli_args, trial)},
    {OPT_PICTURE, 0, "on", "SURFACE",
     "flat, cylinder, drape, or a mesh NAME.obj with texture coordinates (default: cylinder)",
     offsetof(struct cli_args, on)},
    {OPT_PICTURE, 0, "lamp", "THETA,PHI", "angles of the lamp in degrees (default: 45,0; docs/options.md)",
     offsetof(struct cli_args, lamp)},
    {OPT_PICTURE, 0, "lamp-sharpness", "N", "a Gaussian lamp: 10 is soft, 1000 sharp (default: the lamp of the job)",
     offsetof(struct cli_args, lamp_sharpness)},
    {OPT_PICTURE, 0, "camera", "THETA,PHI", "angles of the camera (default: 30,180)",
     offsetof(struct cli_args, camera)},
    {OPT_PICTURE, 0, "px", "N", "width and height of the picture (default: 512)", offsetof(struct cli_args, px)},
    {OPT_PICTURE, 0, "samples", "N", "paths of a pixel (default: 16)", offsetof(struct cli_args, samples)},
    {OPT_PICTURE, 0, "method", "HOW", "path, fast, corrected, dual or diffusion (default: path)",
     offsetof(struct cli_args, method)},
    {OPT_PICTURE, 0, "deep-light", "HOW", "of --method fast: directions or cells (default: directions)",
     offsetof(struct cli_args, deep_light)},
    {OPT_PICTURE, 0, "deep-light-paths", "N", "paths of the table of --method fast (default: 8000000, some minutes)",
     offsetof(struct cli_args, deep_light_paths)},
    {OPT_PICTURE, 0, "visibility", "HOW", "of --method fast: traced or tables (default: traced)",
     offsetof(struct cli_args, visibility)},
    {OPT_PICTURE, 0, "reference", NULL, "compare it with path tracing (default: --method fast)",
     offsetof(struct cli_args, reference)},
    {OPT_PICTURE, 0, "filter", NULL, "also make a filtered view with less noise, for the eye",
     offsetof(struct cli_args, filter)},
    {OPT_PICTURE, 0, "speckle", NULL, "the speckle of single fibers, of models of waves",
     offsetof(struct cli_args, speckle)},
    {OPT_PICTURE, 0, "field-by-pixel", NULL, "near fields of fibers become far fields in wide pixels: less noise",
     offsetof(struct cli_args, field_by_pixel)},
    {OPT_PICTURE, 0, "ground-gap-mm", "MM", "a plane with the shadow, so far under the cloth (default: none)",
     offsetof(struct cli_args, ground_gap_mm)},
    {OPT_PICTURE, 0, "width-mm", "MM", "width of what it shows (default: 40)", offsetof(struct cli_args, width_mm)},
    {OPT_PICTURE, 0, "size-mm", "MM", "edge of the flat or draped piece, length of the cylinder (default: 40)",
     offsetof(struct cli_args, size_mm)},
    {OPT_PICTURE, 0, "radius-mm", "MM", "of the cylinder or ball (default: 15)", offsetof(struct cli_args, radius_mm)},
    {OPT_PICTURE, 0, "wrap-deg", "ANGLE", "how far around the cylinder (default: 180)",
     offsetof(struct cli_args, wrap_deg)},
    {OPT_PICTURE, 0, "black-sheet", "yes|no", "a black sheet under the cloth (default: as in the job)",
     offsetof(struct cli_args, black_sheet)},
    {OPT_PICTURE, 0, "twin", "yes|no", "the cloth under the mouse, too (default: no)", offsetof(struct cli_args, twin)},
    {OPT_PICTURE, 0, "mesh-unit-mm", "MM", "unit of the mesh (default: 1)", offsetof(struct cli_args, mesh_unit_mm)},
    {OPT_TEMPLATE, 0, "template", "JOB.json",
     "job document of samples that have no job.json; '*' in names of files is filled in",
     offsetof(struct cli_args, template)},
    {OPT_MARKER, 0, "marker", "NAME", "file that says that a sample is complete (default: READY)",
     offsetof(struct cli_args, marker)},
    {OPT_QUIET, 0, "quiet", "S", "seconds without a change after which it is complete, too (default: 60; 0: never)",
     offsetof(struct cli_args, quiet_s)},
    {OPT_ONCE, 0, "once", NULL, "end when all samples that are there have ended; status 1 if one failed",
     offsetof(struct cli_args, once)},
    {OPT_FILTER, 0, "state", "STATES", "only jobs in these states, such as queued,running",
     offsetof(struct cli_args, state)},
    {OPT_FILTER, 0, "verdict", "CODES", "only with a verdict: good, usable, does_not_describe_this_cloth, none",
     offsetof(struct cli_args, verdict)},
    {OPT_FILTER, 0, "tag", "TAG", "only with this tag", offsetof(struct cli_args, tag)},
    {OPT_FILTER, 0, "sample", "TEXT", "only samples whose name contains this", offsetof(struct cli_args, sample)},
    {OPT_FILTER, 0, "days", "N", "only jobs of the last N days", offsetof(struct cli_args, days)},
    {OPT_JSON, 0, "json", NULL, "print JSON", offsetof(struct cli_args, json)},
    {OPT_OUT, 'o', "out", "DIR", "folder for the files (default: selvedge-ID)", offsetof(struct cli_args, out_dir)},
    {OPT_FOLLOW, 'f', "follow", NULL, "keep printing until the job ends", offsetof(struct cli_args, follow)},
    {OPT_SCOPE, 0, "scope", "SCOPE", "what the token may do: read, submit or admin", offsetof(struct cli_args, scope)},
    {OPT_OWNER, 0, "owner", "OWNER", "whose jobs it makes and sees (default: NAME)", offsetof(struct cli_args, owner)},
    {OPT_REQUESTS, 0, "requests", "N", "requests a minute; 0: no limit", offsetof(struct cli_args, requests)},
    {OPT_BYTES, 0, "bytes", "N", "bytes of input files that its owner may keep", offsetof(struct cli_args, bytes)},
    {OPT_JOBS, 0, "jobs", "N", "jobs that its owner may keep", offsetof(struct cli_args, jobs)},
    {OPT_MAX_AGE, 0, "max-age-days", "N", "remove jobs that ended more than N days ago",
     offsetof(struct cli_args, max_age)},
    {OPT_MAX_BYTES, 0, "max-bytes", "N",
     "remove the jobs that ended first until all jobs together have at most N bytes",
     offsetof(struct cli_args, max_bytes)},
    {OPT_YES, 0, "yes", NULL, "remove them; without this nothing is removed", offsetof(struct cli_args, yes)},
    {OPT_BATCH, 0, "name", "NAME", "name of the batch (default: that of the table)", offsetof(struct cli_args, name)},
    {OPT_BATCH, 0, "files", "DIR", "folder of the input files (default: the table's folder)",
     offsetof(struct cli_args, files)},
    {OPT_BATCH, 0, "update", NULL, "make a batch of this name like the table", offsetof(struct cli_args, update)},
    {OPT_BATCH, 0, "keep-jobs", NULL, "delete the batch but none of its jobs", offsetof(struct cli_args, keep_jobs)},
    {OPT_BATCH, 0, "delete-jobs", NULL, "delete its jobs, too", offsetof(struct cli_args, delete_jobs)},
    {OPT_CORES, 0, "cores", "N", "time on so many cores (default: those of the service's workers)",
     offsetof(struct cli_args, cores)},
    {OPT_SERVER, 0, "server", "URL", "the daemon (default: SELVEDGE_SERVER or " CLI_DEFAULT_SERVER ")",
     offsetof(struct cli_args, server)},
    {OPT_TOKEN, 0, "token-file", "FILE", "file with the access token (default: SELVEDGE_TOKEN_FILE, SELVEDGE_TOKEN)",
     offsetof(struct cli_args, token_file)},
    {OPT_HELP, 'h', "help", NULL, "show this text", offsetof(struct cli_args, help)},
    {OPT_VERSION, 'V', "version", NULL, "show the version", offsetof(struct cli_args, version)},
};
enum { N_OPTION = sizeof option_table / sizeof option_table[0], OPTION_CODE = 256 };

bool cli_operand_is_id(enum cli_command_id id)
{
    return cli_command_table[id].operand != NULL && cli_command_table[id].needs == NULL;
}

const char *cli_command_name(enum cli_command_id id)
{
    return (unsigned)id < CLI_N_COMMAND ? cli_command_table[id].name : "?";
}

static status find_command(const char *word, enum cli_command_id *id, struct error *err)
{
    size_t best = 99;
    for (int i = 0; i < CLI_N_COMMAND; i++) {
        size_t d = text_distance(word, cli_command_table[i].name);
        if (d < best) best = d, *id = (enum cli_command_id)i;
    }
    if (best == 0) return STATUS_OK;
    if (best <= 2)
        return error_set(err, STATUS_INVALID, "unknown command '%s'; did you mean '%s'?", word,
                         cli_command_table[*id].name);
    return error_set(err, STATUS_INVALID, "unknown command '%s'; `selvedge --help` lists them", word);
}

/* The option of a code that getopt_long gives: OPTION_CODE + index, or a letter. NULL: there is none. */
static const struct cli_option *option_of(int code)
{
    if (code >= OPTION_CODE) return &option_table[code - OPTION_CODE];
    for (size_t i = 0; i < N_OPTION && code != 0; i++)
        if (option_table[i].letter == code) return &option_table[i];
    return NULL;
}

static void apply(struct cli_args *a, const struct cli_option *o, const char *value)
{
    void *at = (char *)a + o->at;
    if (o->value != NULL)
        *(const char **)at = value;
    else
        *(bool *)at = true;
}

/* Letters ("-": operands are returned in their place; ":": a missing value gives a code of its own) and names for
 * getopt_long. */
static void list_options(char letters[2 * N_OPTION + 3], struct option named[N_OPTION + 1])
{
    size_t n = (size_t)snprintf(letters, 3, "-:");
    for (int i = 0; i < N_OPTION; i++) {
        const struct cli_option *o = &option_table[i];
        named[i] = (struct option){o->name, o->value != NULL ? required_argument : no_argument, NULL, OPTION_CODE + i};
        if (o->letter == 0) continue;
        letters[n++] = o->letter;
        if (o->value != NULL) letters[n++] = ':';
        letters[n] = '\0';
    }
    named[N_OPTION] = (struct option){0};
}

/* What getopt_long reported as code, ':' and '?' included. word is the last one that it has read. */
static status take_option(struct cli_args *a, int code, const char *word, int *given, struct error *err)
{
    bool wrong = code == ':' || code == '?';
    const struct cli_option *o = option_of(wrong ? optopt : code);
    if (o == NULL && optopt != 0) return error_set(err, STATUS_INVALID, "unknown option '-%c'; try --help", optopt);
    if (o == NULL) return error_set(err, STATUS_INVALID, "unknown option '%s'; try --help", word);
    if (code == '?') return error_set(err, STATUS_INVALID, "option '--%s' takes no value", o->name);
    if (code == ':')
        return error_set(err, STATUS_INVALID, "option '--%s' needs a value: --%s %s", o->name, o->name, o->value);
    if (o->value != NULL && optarg[0] == '\0')
        return error_set(err, STATUS_INVALID, "option '--%s' has an empty value", o->name);
    *given |= o->bit;
    apply(a, o, optarg);
    return STATUS_OK;
}

/* The first word is the command, the second its operand. */
static status take_word(struct cli_args *a, const char *word, struct error *err)
{
    if (!a->has_command && !a->help && strcmp(word, "help") == 0) {
        a->help = true;
        return STATUS_OK;
    }
    if (!a->has_command) {
        status s = find_command(word, &a->command, err);
        a->has_command = s == STATUS_OK;
        return s;
    }
    if (a->operand != NULL && a->second == NULL && cli_command_table[a->command].second != NULL) {
        a->second = word;
        return STATUS_OK;
    }
    if (a->second != NULL && a->third == NULL && cli_command_table[a->command].third != NULL) {
        a->third = word;
        return STATUS_OK;
    }
    if (a->operand != NULL) {
        const char *operand = cli_command_table[a->command].operand;
        return error_set(err, STATUS_INVALID, "'selvedge %s' takes one %s, but '%s' follows '%s'",
                         cli_command_table[a->command].name, operand == NULL ? "command" : operand, word, a->operand);
    }
    a->operand = word;
    return STATUS_OK;
}

static bool is_given(const struct cli_args *a, const struct cli_option *o)
{
    const void *at = (const char *)a + o->at;
    return o->value != NULL ? *(const char *const *)at != NULL : *(const bool *)at;
}

/* Options and operands must belong to the command. */
static status check(const struct cli_args *a, int given, struct error *err)
{
    const struct cli_command *c = &cli_command_table[a->command];
    int foreign = given & ~(c->option | OPT_EVERYWHERE | OPT_VERSION);
    for (size_t i = 0; i < N_OPTION; i++)
        if ((foreign & option_table[i].bit) != 0 && is_given(a, &option_table[i]))
            return error_set(err, STATUS_INVALID, "'selvedge %s' has no option '--%s'", c->name, option_table[i].name);
    bool may_lack = a->command == CLI_SUBMIT && a->resume_id != NULL;
    if (c->operand != NULL && a->operand == NULL && !may_lack)
        return error_set(err, STATUS_INVALID, "'selvedge %s' needs %s: selvedge %s %s", c->name,
                         c->needs != NULL ? c->needs : "a job id (`selvedge list` shows them)", c->name, c->operand);
    if (c->operand == NULL && a->operand != NULL)
        return error_set(err, STATUS_INVALID, "'selvedge %s' takes no '%s'", c->name, a->operand);
    if (strncmp(a->server, "http://", 7) != 0 && strncmp(a->server, "https://", 8) != 0 &&
        strncmp(a->server, "unix:/", 6) != 0)
        return error_set(err, STATUS_INVALID, "server '%s' is not an http://, https:// or unix:/ address", a->server);
    return STATUS_OK;
}

/* The value of a variable of the environment, or NULL if it is unset or empty. */
static const char *set(const char *value) { return value != NULL && value[0] != '\0' ? value : NULL; }

status cli_args_parse(int argc, char *const *argv, const struct cli_environment *env, struct cli_args *args,
                      struct error *err)
{
    const char *server = set(env->server);
    *args = (struct cli_args){.server = server != NULL ? server : CLI_DEFAULT_SERVER,
                              .token = set(env->token),
                              .token_file = set(env->token_file)};
    char letters[2 * N_OPTION + 3];
    struct option named[N_OPTION + 1];
    int given = 0;
    status s = STATUS_OK;
    list_options(letters, named);
    optind = 0; /* start anew */
    for (int code; s == STATUS_OK && (code = getopt_long(argc, argv, letters, named, NULL)) != -1;)
        s = code == 1 ? take_word(args, optarg, err) : take_option(args, code, argv[optind - 1], &given, err);
    while (s == STATUS_OK && optind < argc) s = take_word(args, argv[optind++], err); /* after "--" */
    if (s != STATUS_OK) return s;
    if (args->help || args->version) return STATUS_OK;
    if (!args->has_command) return error_set(err, STATUS_INVALID, "no command given; `selvedge --help` lists them");
    return check(args, given, err);
}

/* Append to a bounded buffer; *at never passes n. */
static void put(char *text, size_t n, size_t *at, const char *format, ...) __attribute__((format(printf, 4, 5)));
static void put(char *text, size_t n, size_t *at, const char *format, ...)
{
    if (*at >= n) return;
    va_list list;
    va_start(list, format);
    int written = vsnprintf(text + *at, n - *at, format, list);
    va_end(list);
    if (written > 0) *at += (size_t)written;
}

static void put_options(int mask, char *text, size_t n, size_t *at)
{
    for (size_t i = 0; i < N_OPTION; i++) {
        const struct cli_option *o = &option_table[i];
        if ((o->bit & mask) == 0) continue;
        char left[32];
        snprintf(left, sizeof left, "--%s%s%s", o->name, o->value == NULL ? "" : " ", o->value == NULL ? "" : o->value);
        char letter[5] = "    ";
        if (o->letter != 0) snprintf(letter, sizeof letter, "-%c, ", o->letter);
        put(text, n, at, "  %s%-15s %s\n", letter, left, o->what);
    }
}

void cli_help(const struct cli_args *args, char *text, size_t n_bytes)
{
    size_t at = 0;
    if (args->has_command) {
        const struct cli_command *c = &cli_command_table[args->command];
        put(text, n_bytes, &at, "usage: selvedge %s%s%s [options]\n\n%s%s.\n%s%s\noptions:\n", c->name,
            c->operand == NULL ? "" : " ", c->operand == NULL ? "" : c->operand, "", c->what,
            c->more[0] == '\0' ? "" : "\n", c->more);
        put_options(c->option | OPT_EVERYWHERE, text, n_bytes, &at);
        return;
    }
    put(text, n_bytes, &at,
        "selvedge: fit the scattering of a cloth's fibers, through a selvedged server\n\n"
        "usage: selvedge COMMAND [options]\n\ncommands:\n");
    for (int i = 0; i < CLI_N_COMMAND; i++) {
        char left[32];
        const struct cli_command *c = &cli_command_table[i];
        snprintf(left, sizeof left, "%s %s", c->name, c->operand == NULL ? "" : c->operand);
        put(text, n_bytes, &at, "  %-18s %s\n", left, c->what);
    }
    put(text, n_bytes, &at, "%s\noptions of every command:\n", cli_tool_help());
    put_options(OPT_EVERYWHERE | OPT_VERSION, text, n_bytes, &at);
    put(text, n_bytes, &at,
        "\n`selvedge help COMMAND` describes a command. docs/options.md describes the job document.\n"
        "Exit status: 0 done, 1 error or failed job, 2 wrong command line, 3 cancelled job, 130 interrupted.\n");
}
