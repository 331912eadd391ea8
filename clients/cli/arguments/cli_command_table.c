#include "clients/cli/arguments/cli_command_table.h"
#include "clients/cli/arguments/cli_option_bits.h"

#include <stddef.h>

const struct cli_command cli_command_table[CLI_N_COMMAND] = {
    [CLI_SUBMIT] =
        {"submit", "JOB.json", "send a job document and its files, and start the job",
         "Every file that the document names is taken from the document's folder (or --input-dir), declared with\n"
         "its SHA-256 and uploaded. An upload that breaks continues where it stopped; `selvedge submit --resume ID`\n"
         "continues a submit that was interrupted. Prints the job's id on standard output.\n",
         OPT_INPUT | OPT_WATCH | OPT_RESUME | OPT_DRAFT | OPT_ID_FILE, "a job document"},
    [CLI_CHECK] =
        {"check", "JOB.json", "check a job document and its files, without a server",
         "Every file is opened and judged, and all faults are printed at once; nothing is uploaded. Files are taken\n"
         "from the document's folder (or --input-dir). Exit status 1 when there are faults.\n",
         OPT_INPUT | OPT_JSON, "a job document"},
    [CLI_RECONSTRUCT] =
        {"reconstruct", "SCAN", "trace the fibers of a scan, without photographs, and download the results",
         "SCAN is a file (TIFF, .mhd, .mha, .nrrd, .nhdr, .vol) or a folder of TIFF slices. The job ends with the\n"
         "geometry; a later job goes on from it (\"geometry\": {\"job\": ID} in its document). The results go to the\n"
         "folder of --out (default: selvedge-ID).\n",
         OPT_SCAN | OPT_OUT | OPT_ID_FILE, "a scan"},
    [CLI_RENDER] =
        {"render", "ID", "show the cloth of a finished job on a surface, and download the picture",
         "A job of its own renders the job's fibers with the fitted parameters, fiber by fiber. The results go to the\n"
         "folder of --out (default: selvedge-ID): pictures/on-1.png, and on-1.exr with the radiance.\n",
         OPT_PICTURE | OPT_OUT | OPT_ID_FILE},
    [CLI_STATUS] = {"status", "ID", "show one job", "Exit status 0 whatever the job's state is.\n", OPT_JSON},
    [CLI_WATCH] =
        {"watch", "ID", "follow a job until it ends",
         "A live progress line in a terminal, one line per change otherwise. Exit status 0 when the job succeeded,\n"
         "1 when it failed, 3 when it was cancelled.\n",
         0},
    [CLI_LIST] = {"list", NULL, "list the jobs, newest first", "", OPT_JSON | OPT_FILTER},
    [CLI_CANCEL] = {"cancel", "ID", "stop a job; its results so far are kept", "", 0},
    [CLI_RETRY] = {"retry", "ID", "start a failed or cancelled job again from its last checkpoint", "", 0},
    [CLI_RESULTS] =
        {"results", "ID", "download the results",
         "Files go to the folder of --out (default: selvedge-ID). A download that breaks continues where it stopped;\n"
         "complete files are not downloaded again.\n",
         OPT_OUT},
    [CLI_VERSIONS] =
        {"versions", "ID", "list the results of a job's earlier runs, or download one",
         "A job that is edited and run again keeps its earlier results, each under the number of its run. With a\n"
         "NUMBER its files go to the folder of --out (default: selvedge-ID-NUMBER).\n",
         OPT_OUT | OPT_JSON, NULL, "NUMBER"},
    [CLI_LOG] = {"log", "ID", "print the job's log", "", OPT_FOLLOW},
    [CLI_SERIES] = {"series", "ID", "print the fit step by step: objective, residual, parameters (tab-separated)", "",
                    OPT_JSON},
    [CLI_DELETE] = {"delete", "ID", "remove a job and its files",
                    "A running job is stopped first; its results are lost.\n", 0},
    [CLI_WATCH_FOLDER] =
        {"watch-folder", "DIR", "make a job of every sample folder that is put into DIR",
         "A sample folder NAME is complete when it has the marker file, or has not changed for the quiet time. It "
         "becomes\n"
         "a job by its job.json or by the template; results, or the reason why there are none, are then in "
         "NAME.selvedge\n"
         "beside it. Runs until it is stopped; what is known is on disk, so it may be killed at any time.\n",
         OPT_TEMPLATE | OPT_MARKER | OPT_QUIET | OPT_ONCE, "a folder"},
    [CLI_TOKEN] =
        {"token", "ACTION", "make, list or revoke access tokens",
         "selvedge token make NAME --scope SCOPE    prints the token, which is shown only once (--out: into a file)\n"
         "selvedge token list                       all tokens, newest first\n"
         "selvedge token revoke NAME                or its id; the next request with it is refused\n"
         "These need a token with scope admin; the first one is made by `selvedged --make-token NAME`.\n",
         OPT_SCOPE | OPT_OWNER | OPT_REQUESTS | OPT_BYTES | OPT_JOBS | OPT_JSON | OPT_OUT, "make, list or revoke",
         "NAME"},
    [CLI_KEEP] = {"keep", "ID", "keep a job, whatever the limits of retention say", "", 0},
    [CLI_UNKEEP] = {"unkeep", "ID", "take that back", "", 0},
    [CLI_RETENTION] =
        {"retention", NULL, "list the finished jobs that limits of age and size would remove; --yes removes them",
         "Without options the limits are those of the service's settings. Only jobs that have ended are removed, but\n"
         "not those that are kept (`selvedge keep ID`), nor those whose geometry an unfinished job asks for. With\n"
         "--yes exactly the listed jobs are removed, and each is named.\n",
         OPT_MAX_AGE | OPT_MAX_BYTES | OPT_YES | OPT_JSON},
    [CLI_BATCH] =
        {"batch", "ACTION", "run many samples with one template, or say how they are",
         "selvedge batch submit TEMPLATE.json TABLE.csv    a job of each row; or a folder with a folder of each "
         "sample\n"
         "selvedge batch list\n"
         "selvedge batch show|start|retry|cancel NAME      or its id; retry queues all that have failed\n"
         "selvedge batch results NAME                      table of results as CSV (--json; --out FILE)\n"
         "selvedge batch delete NAME --keep-jobs|--delete-jobs\n"
         "docs/automation.md describes the table. Submitting a changed table with --update runs only what differs.\n",
         OPT_BATCH | OPT_DRAFT | OPT_JSON | OPT_OUT,
         "an action: submit, list, show, start, retry, cancel, results or delete", "NAME", "TABLE"},
    [CLI_PLAN] = {"plan", "BATCH", "tell what a batch will take, before it runs, and how far off that was",
                  "Samples that have not run are planned anew: processor time, time on --cores cores, memory and disk. "
                  "Of those\n"
                  "that ran since they were planned, what they took stands beside it.\n",
                  OPT_CORES | OPT_JSON, "the name or the id of a batch"},
};
