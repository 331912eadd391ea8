/* Programs that are installed beside this one. */
#ifndef SELVEDGE_CLI_SIBLING_H
#define SELVEDGE_CLI_SIBLING_H

enum { CLI_SIBLING_BYTES = 4096 };

/* Writes the file that execvp should run for the program `name`: the file beside this program, or `name` alone, which
 * execvp then looks for in PATH. */
void cli_sibling(const char *name, char path[CLI_SIBLING_BYTES]);

#endif
