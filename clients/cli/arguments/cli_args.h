/* The command line of `selvedge`, parsed. */
#ifndef SELVEDGE_CLIENTS_CLI_ARGS_H
#define SELVEDGE_CLIENTS_CLI_ARGS_H

#include "clients/cli/arguments/cli_command_table.h"

#include <stdbool.h>

#define CLI_DEFAULT_SERVER "http://127.0.0.1:7878"

/* Types of the options of a picture. */
typedef const char *CLI_PICTURE_number, *CLI_PICTURE_whole, *CLI_PICTURE_text, *CLI_PICTURE_yes;
typedef bool CLI_PICTURE_flag;

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
    const char *input_dir;                 /* --input-dir: the folder of the files that the document names */
    const char *out_dir;                   /* --out */
    const char *resume_id;                 /* --resume */
    const char *to;                        /* --to: formats of an export */
    const char *texture_cm, *texture_px;   /* numbers of exported textures */
    const char *id_file;                   /* --id-file */
    const char *names, *weave;             /* --names: of photographs; --weave: of a cloth without a scan */
    const char *require;                   /* --require: the worst verdict that is accepted */
    const char *voxel_um;                  /* --voxel-um */
    const char *axes;                      /* --axes */
    const char *hollow, *diameter_voxel;   /* --hollow, --diameter-voxel: of a scan */
    const char *template;                  /* --template */
    const char *marker;                    /* --marker */
    const char *quiet_s;                   /* --quiet */
    const char *on, *lamp, *camera, *twin; /* of a picture; on: --on, and so forth */
    struct {
#define PICTURE_OPTION(key, name, value, kind, help) CLI_PICTURE_##kind key;
#include "clients/cli/arguments/picture_options.def"
#undef PICTURE_OPTION
    } picture;                                           /* members of the picture in the job document */
    const char *scope, *owner, *requests, *bytes, *jobs; /* of a token to be made */
    const char *max_age, *max_bytes;                     /* of retention */
    const char *state, *verdict, *tag, *sample, *days;   /* of list */
    bool watch, json, follow, draft, align, once, yes;
    bool revoke, links; /* --revoke, --links: of share */
    bool turntable;     /* --turntable: of render */
    bool trial;         /* --trial: of a scan */
    bool help;          /* --help was given: for one command if has_command is set */
    bool version;
    bool has_command;
};

#endif
