#include "base/process.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static double seconds_of(const struct timeval *t) { return (double)t->tv_sec + 1e-6 * (double)t->tv_usec; }

/* Linux counts the peak of the program that started this one into ru_maxrss, but not into VmHWM. 0: not to be read. */
static long long peak_kib(void)
{
    FILE *f = fopen("/proc/self/status", "re");
    char line[256];
    long long kib = 0;
    while (f != NULL && kib == 0 && fgets(line, sizeof line, f) != NULL)
        if (sscanf(line, "VmHWM: %lld kB", &kib) != 1) kib = 0;
    if (f != NULL) fclose(f);
    return kib;
}

struct process_use process_use(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    const long long own_kib = peak_kib();
    return (struct process_use){.cpu_s = seconds_of(&usage.ru_utime) + seconds_of(&usage.ru_stime),
                                .peak_rss_bytes = (own_kib > 0 ? own_kib : usage.ru_maxrss) * 1024};
}

bool program_folder(char *folder, size_t n_bytes)
{
    ssize_t n = readlink("/proc/self/exe", folder, n_bytes);
    folder[n > 0 && (size_t)n < n_bytes ? n : 0] = '\0';
    char *slash = strrchr(folder, '/');
    if (slash != NULL) *slash = '\0';
    return slash != NULL;
}

bool program_find(const char *name, char *folder, size_t n_bytes)
{
    const char *from = getenv("PATH");
    while (from != NULL && *from != '\0') {
        char path[4096];
        const int n = (int)strcspn(from, ":"), length = snprintf(path, sizeof path, "%.*s/%s", n, from, name);
        if (n > 0 && length < (int)sizeof path && (size_t)n < n_bytes && access(path, X_OK) == 0) {
            snprintf(folder, n_bytes, "%.*s", n, from);
            return true;
        }
        from += n + (from[n] == ':');
    }
    folder[0] = '\0';
    return false;
}
