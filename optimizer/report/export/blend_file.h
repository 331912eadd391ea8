/* results/export/blender/cloth.blend: the scene of cloth.py as Blender's own file, made by Blender where this machine
 * has it, in a process of its own (findings/program_helper.h). */
#ifndef SELVEDGE_OPTIMIZER_BLEND_FILE_H
#define SELVEDGE_OPTIMIZER_BLEND_FILE_H

#include "optimizer/report/findings/report.h"

/* Returns whether PATH has Blender; prefix: the folder of its files. */
bool blend_file_possible(char prefix[WORKER_PATH_BYTES]);

struct blend_paths {
    char script[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES], to[WORKER_PATH_BYTES];
};
void blend_file_paths(const struct worker_folder *folder, struct blend_paths *p);

/* Makes the file of the scripts in the folder. A file that cannot be made is a warning. STATUS_CANCELLED. */
status blend_file_write(struct report *report, struct error *err);

#endif
