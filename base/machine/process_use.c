#include "base/machine/process_use.h"

#include <sys/resource.h>

static double seconds_of(const struct timeval *t) { return (double)t->tv_sec + 1e-6 * (double)t->tv_usec; }

struct process_use process_use(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return (struct process_use){.cpu_s = seconds_of(&usage.ru_utime) + seconds_of(&usage.ru_stime),
                                .peak_rss_bytes = (int64_t)usage.ru_maxrss * 1024};
}
