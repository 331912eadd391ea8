#include "base/program_folder.h"

#include <string.h>
#include <unistd.h>

bool program_folder(char *folder, size_t n_bytes)
{
    ssize_t n = readlink("/proc/self/exe", folder, n_bytes);
    folder[n > 0 && (size_t)n < n_bytes ? n : 0] = '\0';
    char *slash = strrchr(folder, '/');
    if (slash != NULL) *slash = '\0';
    return slash != NULL;
}
