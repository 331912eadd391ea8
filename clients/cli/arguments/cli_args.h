/* The command line of `selvedge`. Parsing and help texts come from a table of commands and a table of options. The
 * functions print nothing, and read only the environment that they are given. */
#ifndef SELVEDGE_CLIENTS_CLI_ARGS_H
#define SELVEDGE_CLIENTS_CLI_ARGS_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

#define CLI_DEFAULT_SERVER "http://127.0.0.1:7878"

enum cli_command_id {
    CLI_SUBMIT,
    CLI_CHECK,
    CLI_RECONSTRUCT,
    CLI_RENDER,
    CLI_STATUS,
    CLI_WATCH,
    CLI_LIST,
    CLI_CANCEL,
    CLI_RETRY,
    CLI_RESULTS,
    CLI_VERSIONS,
    CLI_LOG,
    CLI_SERIES,
    CLI_DELETE,
    CLI_WATCH_FOLDER,
    CLI_TOKEN,
    CLI_KEEP,
    CLI_UNKEEP,
    CLI_RETENTION,
    CLI_BATCH,
    CLI_PLAN,
    CLI_N_COMMAND
};

/* All that the command line says. The strings point into argv or the environment; NULL if not given. */
struct cli_args {
    enum cli_command_id command;
    const char *server, *token, *token_file; /* a token in a file goes before one of the environment */
    const char *
        operand; /* a job document for submit and check, a scan for reconstruct, a folder for watch-folder, a job id for
                     the other commands, an action for token and batch, a batch for plan */
    const char *second; /* the name that follows an action of token or batch, its template for batch submit, or a number
                           that follows an id */
    const char *third;  /* the table of batch submit */
    const char *files, *name; /* of a batch */
    const char *cores;        /* --cores: of a plan */
    bool update, keep_jobs, delete_jobs;
    const char *input_dir;               /* --input-dir: the folder of the files that the document names */
    const char *out_dir;                 /* --out */
    const char *resume_id;               /* --resume */
    const char *id_file;                 /* --id-file */
    const char *voxel_um;                /* --voxel-um */
    const char *axes;                    /* --axes */
    const char *hollow, *diameter_voxel; /* --hollow, --diameter-voxel: of a scan */
    const char *template;                /* --template */
    const char *marker;                  /* --marker */
    const char *quiet_s;                 /* --quiet */
    /* of a picture; on: --on, and so forth */
    const char *on, *lamp, *camera, *px, *samples, *width_mm, *size_mm, *radius_mm, *mesh_unit_mm, *wrap_deg, *method,
        *deep_light, *deep_light_paths, *visibility, *black_sheet, *twin;
    const char *scope, *owner, *requests, *bytes, *jobs; /* of a token to be made */
    const char *max_age, *max_bytes;                     /* of retention */
    const char *state, *verdict, *tag, *sample, *days;   /* of list */
    bool watch, json, follow, draft, align, once, yes;
    bool trial;     /* --trial: of a scan */
    bool reference; /* --reference: of a picture */
    bool filter;    /* --filter: of a picture */
    bool speckle;   /* --speckle: likewise */
    bool field_by_pixel;
    const char *ground_gap_mm;
    const char *lamp_sharpness;
    bool help; /* --help was given: for one command if has_command is set */
    bool version;
    bool has_command;
};

/* The values of SELVEDGE_SERVER, SELVEDGE_TOKEN and SELVEDGE_TOKEN_FILE, NULL if unset. */
struct cli_environment {
    const char *server, *token, *token_file;
};

/* Options override the environment. A token is never an option: other users see the list of processes. STATUS_INVALID
 * for an unknown command or option (the text names the nearest known one) and for a missing or extra operand. */
status cli_args_parse(int argc, char *const *argv, const struct cli_environment *env, struct cli_args *args,
                      struct error *err);

/* Whether the operand of the command is the id of a job. */
bool cli_operand_is_id(enum cli_command_id id);
const char *cli_command_name(enum cli_command_id id);
/* Writes the help text of one command, or of the program if has_command is false: at most n_bytes, NUL-terminated. */
void cli_help(const struct cli_args *args, char *text, size_t n_bytes);

#endif
