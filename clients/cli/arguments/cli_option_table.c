#include "clients/cli/arguments/cli_option_table.h"

#include <string.h>

/* begins another line of a help text */
#define CLI_NEXT_LINE "\n                      "

const struct cli_option cli_option_table[CLI_N_OPTION] = {
    {NULL, 0, "input-dir", "DIR", "folder of the input files (default: the document's folder)",
     offsetof(struct cli_args, input_dir)},
    {NULL, 'w', "watch", NULL, "follow the job until it ends", offsetof(struct cli_args, watch)},
    {NULL, 0, "names", "PATTERN",
     "angles in the names of photographs, such as \"t{light_theta}_p{light_phi}\"; also {camera_theta}," CLI_NEXT_LINE
     "{camera_phi}, {rotation}, and * for any text (default: the usual ones are tried)",
     offsetof(struct cli_args, names)},
    {NULL, 0, "weave", "NAME",
     "weave of a cloth that was not scanned: plain, twill, satin ... (docs/described-cloth.md)",
     offsetof(struct cli_args, weave)},
    {NULL, 0, "require", "VERDICT",
     "status 4 if the result has a worse verdict than this: good, good_but_undetermined or" CLI_NEXT_LINE
     "pictures_only (needs --watch with submit)",
     offsetof(struct cli_args, require)},
    {NULL, 0, "resume", "ID",
     "continue an interrupted submit of job ID (JOB.json is then not needed" CLI_NEXT_LINE
     "if the files are in the current folder or --input-dir)",
     offsetof(struct cli_args, resume_id)},
    {NULL, 0, "draft", NULL, "upload everything but do not start the job", offsetof(struct cli_args, draft)},
    {NULL, 0, "id-file", "FILE", "write the job's id to FILE as soon as there is one (for scripts)",
     offsetof(struct cli_args, id_file)},
    {"scan", 0, "voxel-um", "UM", "edge of a voxel in micrometres, or three, such as 2,2,3 (default: the file's)",
     offsetof(struct cli_args, voxel_um)},
    {"scan", 0, "axes", "XYZ", "which axis of the file is weft, warp and height, such as xzy (default: xyz)",
     offsetof(struct cli_args, axes)},
    {"scan", 0, "align", NULL, "turn weft and warp to x and y, and crop to what repeats",
     offsetof(struct cli_args, align)},
    {"scan", 0, "hollow", "yes|no", "whether the fibers are hollow, as cotton (default: decided from the scan)",
     offsetof(struct cli_args, hollow)},
    {"scan", 0, "diameter-voxel", "N", "diameter of the fibers in voxels (default: measured)",
     offsetof(struct cli_args, diameter_voxel)},
    {"scan", 0, "trial", NULL, "also state what such a scan can give, by a phantom of the traced fibers",
     offsetof(struct cli_args, trial)},
    {"picture", 0, "on", "SURFACE",
     "flat, cylinder, drape, or a mesh NAME.obj with texture coordinates (default: cylinder)",
     offsetof(struct cli_args, on)},
    {"picture", 0, "lamp", "THETA,PHI", "angles of the lamp in degrees (default: 45,0; docs/options.md)",
     offsetof(struct cli_args, lamp)},
    {"picture", 0, "camera", "THETA,PHI", "angles of the camera (default: 30,180)", offsetof(struct cli_args, camera)},
    {"picture", 0, "twin", "yes|no", "the cloth under the mouse, too (default: no)", offsetof(struct cli_args, twin)},
    {"picture", 0, "turntable", NULL,
     "24 pictures in the studio of a cloth that turns once, as turntable.webp, which loops (default of" CLI_NEXT_LINE
     "--kind: drape; of --px: 360; of --samples: 6; of --deep-light-paths: 1000000)",
     offsetof(struct cli_args, turntable)},
#define PICTURE_OPTION(key, name, value, kind, help)                                                                   \
    {"picture", 0, name, value, help, offsetof(struct cli_args, picture.key)},
#include "clients/cli/arguments/picture_options.def"
#undef PICTURE_OPTION
    {NULL, 0, "to", "FORMAT", "mitsuba, pbrt, usd, blender, textures, gltf, pdf (the report), several between commas",
     offsetof(struct cli_args, to)},
    {NULL, 0, "texture-cm", "CM", "edge of exported textures, 2 to 20 (default: 2)",
     offsetof(struct cli_args, texture_cm)},
    {NULL, 0, "texture-px", "N", "most pixels of their longer edge, up to 4096 (default: 2048)",
     offsetof(struct cli_args, texture_px)},
    {NULL, 0, "revoke", NULL, "end all links of the job", offsetof(struct cli_args, revoke)},
    {NULL, 0, "links", NULL, "list the links that are valid", offsetof(struct cli_args, links)},
    {NULL, 0, "template", "JOB.json",
     "job document of samples that have no job.json; '*' in names of files is filled in",
     offsetof(struct cli_args, template)},
    {NULL, 0, "marker", "NAME", "file that says that a sample is complete (default: READY)",
     offsetof(struct cli_args, marker)},
    {NULL, 0, "quiet", "S", "seconds without a change after which it is complete, too (default: 60; 0: never)",
     offsetof(struct cli_args, quiet_s)},
    {NULL, 0, "once", NULL, "end when all samples that are there have ended; status 1 if one failed",
     offsetof(struct cli_args, once)},
    {"selection", 0, "state", "STATES", "only jobs in these states, such as queued,running",
     offsetof(struct cli_args, state)},
    {"selection", 0, "verdict", "CODES",
     "only with a verdict: good, good_but_undetermined, pictures_only," CLI_NEXT_LINE
     "does_not_describe_this_cloth, none, or usable (of older results), between commas",
     offsetof(struct cli_args, verdict)},
    {"selection", 0, "tag", "TAG", "only with this tag", offsetof(struct cli_args, tag)},
    {"selection", 0, "sample", "TEXT", "only samples whose name contains this", offsetof(struct cli_args, sample)},
    {"selection", 0, "days", "N", "only jobs of the last N days; of share: how long the link is valid",
     offsetof(struct cli_args, days)},
    {NULL, 0, "json", NULL, "print JSON", offsetof(struct cli_args, json)},
    {NULL, 'o', "out", "DIR", "folder for the files (default: selvedge-ID)", offsetof(struct cli_args, out_dir)},
    {NULL, 'f', "follow", NULL, "keep printing until the job ends", offsetof(struct cli_args, follow)},
    {NULL, 0, "scope", "SCOPE", "what the token may do: read, submit or admin", offsetof(struct cli_args, scope)},
    {NULL, 0, "owner", "OWNER", "whose jobs it makes and sees (default: NAME)", offsetof(struct cli_args, owner)},
    {NULL, 0, "requests", "N", "requests a minute; 0: no limit", offsetof(struct cli_args, requests)},
    {NULL, 0, "bytes", "N", "bytes of input files that its owner may keep", offsetof(struct cli_args, bytes)},
    {NULL, 0, "jobs", "N", "jobs that its owner may keep", offsetof(struct cli_args, jobs)},
    {NULL, 0, "max-age-days", "N", "remove jobs that ended more than N days ago", offsetof(struct cli_args, max_age)},
    {NULL, 0, "max-bytes", "N", "remove the jobs that ended first until all jobs together have at most N bytes",
     offsetof(struct cli_args, max_bytes)},
    {NULL, 0, "yes", NULL, "remove them; without this nothing is removed", offsetof(struct cli_args, yes)},
    {"batch", 0, "name", "NAME", "name of the batch (default: that of the table)", offsetof(struct cli_args, name)},
    {"batch", 0, "files", "DIR", "folder of the input files (default: the table's folder)",
     offsetof(struct cli_args, files)},
    {"batch", 0, "update", NULL, "make a batch of this name like the table", offsetof(struct cli_args, update)},
    {"batch", 0, "keep-jobs", NULL, "delete the batch but none of its jobs", offsetof(struct cli_args, keep_jobs)},
    {"batch", 0, "delete-jobs", NULL, "delete its jobs, too", offsetof(struct cli_args, delete_jobs)},
    {NULL, 0, "cores", "N", "time on so many cores (default: those of the service's workers)",
     offsetof(struct cli_args, cores)},
    {CLI_EVERYWHERE, 0, "server", "URL", "the daemon (default: SELVEDGE_SERVER or " CLI_DEFAULT_SERVER ")",
     offsetof(struct cli_args, server)},
    {CLI_EVERYWHERE, 0, "token-file", "FILE",
     "file with the access token (default: SELVEDGE_TOKEN_FILE, SELVEDGE_TOKEN)",
     offsetof(struct cli_args, token_file)},
    {CLI_EVERYWHERE, 'h', "help", NULL, "show this text", offsetof(struct cli_args, help)},
    {NULL, 'V', "version", NULL, "show the version", offsetof(struct cli_args, version)},
};

static bool names(const char *list, const char *word)
{
    const size_t n = strlen(word);
    for (const char *at = list; at != NULL && (at = strstr(at, word)) != NULL; at += n)
        if ((at == list || at[-1] == ' ') && (at[n] == ' ' || at[n] == '\0')) return true;
    return false;
}

bool cli_takes_option(const struct cli_command *command, const struct cli_option *option)
{
    if (option->group != NULL && strcmp(option->group, CLI_EVERYWHERE) == 0) return true;
    return names(command->options, option->name) || (option->group != NULL && names(command->options, option->group));
}
