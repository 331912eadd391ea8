/* selvedge-camera reads photographs as jobs do: previews of them, and the record of a camera's noise. It needs no
 * daemon. */
#include "base/version.h"
#include "optimizer/tools/camera/camera_commands.h"

#include <stdio.h>
#include <string.h>

static const char usage[] =
    "selvedge-camera: photographs as jobs read them\n"
    "\n"
    "  selvedge photo FILE... [options]                  what becomes of a photograph, step by step\n"
    "  selvedge calibrate-camera --dark FILE... --flat FILE... --out RECORD.json [options]\n"
    "                                                    the record of a camera's noise\n"
    "  selvedge bowl JOB.json --out PROFILE.csv [--picture PICTURE.png]\n"
    "                                                    the profile of a fiber from photographs of a bowl\n"
    "\n"
    "options of photo:\n"
    "  --crop-px X0 Y0 X1 Y1    the part that is used (default: all)\n"
    "  --transfer linear|srgb   how integer values stand for light (PNG, JPEG, integer TIFF)\n"
    "  --exposure-s S, --iso N, --aperture N, --black-level N   in place of what the file states\n"
    "  --out PICTURE.png        the picture with the crop drawn on it (one FILE alone); with\n"
    "                           --job a folder, which gets such a picture of every photograph, and of the color chart\n"
    "  --job JOB.json           preview the photographs of a job document, with its dark frames, exposures and colors\n"
    "  --json OUT.json          with --job: what it prints, and the crops and cameras that it found, as a JSON list\n"
    "options of calibrate-camera:\n"
    "  --dark FILE...           at least 2 frames with the lens covered, of the same exposure time in a row; better\n"
    "                           some of the shortest and some of the longest exposure time that you use\n"
    "  --flat FILE...           at least 2 frames of an evenly lit white surface, out of focus, not saturated\n"
    "  --transfer linear        for integer TIFF or PNG\n"
    "  --exposure-s S           of frames that do not state it\n"
    "options of bowl:\n"
    "  --picture PICTURE.png    the first photograph with lines of theta_o (blue) and azimuth (orange) every 15 "
    "degrees,\n"
    "                           and in red what does not count\n"
    "\n"
    "Exit codes: 0 done, 1 failed, 2 wrong arguments.\n";

static const struct {
    const char *name;
    int (*run)(int argc, char **argv);
} command[] = {
    {"photo", camera_command_photo}, {"calibrate-camera", camera_command_calibrate}, {"bowl", camera_command_bowl}};

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            fputs(usage, stdout);
            return 0;
        }
    if (argc >= 2 && strcmp(argv[1], "--version") == 0) {
        puts("selvedge-camera " SELVEDGE_VERSION);
        return 0;
    }
    for (size_t i = 0; argc >= 2 && i < sizeof command / sizeof *command; i++)
        if (strcmp(argv[1], command[i].name) == 0) return command[i].run(argc - 1, argv + 1);
    fputs(usage, stderr);
    return 2;
}
