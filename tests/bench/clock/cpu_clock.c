/* Preloaded into a program, makes its monotonic clock one of its own processor time, divided by CPU_CLOCK_THREADS (1),
 * so that predictions of remaining time can be judged on a machine that others use at the same time. */
#define _GNU_SOURCE
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

int clock_gettime(clockid_t clock, struct timespec *t)
{
    if (clock != CLOCK_MONOTONIC) return (int)syscall(SYS_clock_gettime, clock, t);
    const char *word = getenv("CPU_CLOCK_THREADS");
    const long n = word != NULL ? strtol(word, NULL, 10) : 1;
    int result = (int)syscall(SYS_clock_gettime, CLOCK_PROCESS_CPUTIME_ID, t);
    long long ns = (1000000000LL * t->tv_sec + t->tv_nsec) / (n > 0 ? n : 1);
    t->tv_sec = (time_t)(ns / 1000000000LL);
    t->tv_nsec = (long)(ns % 1000000000LL);
    return result;
}
