/* The formats of exports.c. Each file export_<name>.c lists at its head the files of its folder. */
#ifndef SELVEDGE_OPTIMIZER_EXPORT_FORMATS_H
#define SELVEDGE_OPTIMIZER_EXPORT_FORMATS_H

#include "optimizer/report/export/export_scene.h"

extern const struct export_format export_mitsuba, export_pbrt, export_usd, export_textures, export_blender;

#endif
