/* selvedge-phantom makes artificial cloth whose fibers and scattering parameters are known, for trials of the whole
 * process and for measurements of its accuracy. */
#include "base/version.h"
#include "optimizer/tools/phantom/phantom_commands.h"

#include <stdio.h>
#include <string.h>

static const char usage[] =
    "selvedge-phantom: artificial cloth with known fibers and known scattering parameters\n"
    "\n"
    "  selvedge-phantom cloth --out DIR [options]        make fibers, and the CT scan of them\n"
    "  selvedge-phantom photograph --fibers FILE --out DIR [options]\n"
    "                                                    render photographs with known parameters\n"
    "  selvedge-phantom camera --photographs DIR --out DIR [options]\n"
    "                                                    take them again as raw files of a simulated camera\n"
    "  selvedge-phantom compare --truth FILE --fibers FILE [options]\n"
    "                                                    measure reconstructed fibers against true ones\n"
    "  selvedge-phantom detect --photograph FILE [options]\n"
    "                                                    find the weave of a real cloth in photographs\n"
    "  selvedge-phantom look --photograph FILE --rendering FILE --period-px P [options]\n"
    "                                                    compare color and texture of a rendering and a photograph\n"
    "  selvedge-phantom mesh --on SHAPE --out FILE.obj [options]\n"
    "                                                    write a surface that pictures show the cloth on\n"
    "\n"
    "  selvedge-phantom --version                        print the version\n"
    "\n"
    "Each command has a --help of its own. Exit codes: 0 done, 1 failed, 2 wrong arguments.\n";

static const struct {
    const char *name;
    int (*run)(int argc, char **argv);
} command[] = {
    {"cloth", phantom_command_cloth},   {"photograph", phantom_command_photograph},
    {"camera", phantom_command_camera}, {"compare", phantom_command_compare},
    {"detect", phantom_command_detect}, {"look", phantom_command_look},
    {"mesh", phantom_command_mesh},
};

int main(int argc, char **argv)
{
    if (argc >= 2 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0)) {
        fputs(usage, stdout);
        return 0;
    }
    if (argc >= 2 && strcmp(argv[1], "--version") == 0) {
        puts("selvedge-phantom " SELVEDGE_VERSION);
        return 0;
    }
    for (size_t i = 0; argc >= 2 && i < sizeof command / sizeof *command; i++)
        if (strcmp(argv[1], command[i].name) == 0) return command[i].run(argc - 1, argv + 1);
    if (argc >= 2) fprintf(stderr, "selvedge-phantom: unknown command '%s'\n", argv[1]);
    fputs(usage, stderr);
    return 2;
}
