/* The machine: processor, memory, descriptors, kernel, clock. */
#include "base/clock.h"
#include "server/doctor/doctor_report.h"
#include "server/settings/job_paths.h"

#include <linux/landlock.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/timex.h>
#include <unistd.h>

/* 2024-01-01: older than this program */
static const double least_wall_s = 1704067200;

/* The first word in a file such as /proc/meminfo after the line's key; -1 if there is none. */
static long long number_after(const char *path, const char *key)
{
    char line[256];
    long long value = -1;
    FILE *f = fopen(path, "re");
    if (f == NULL) return -1;
    while (value < 0 && fgets(line, sizeof line, f) != NULL)
        if (strncmp(line, key, strlen(key)) == 0) value = strtoll(line + strlen(key), NULL, 10);
    fclose(f);
    return value;
}

static void examine_processor(struct doctor *d)
{
    const struct settings *s = d->settings;
    long n = sysconf(_SC_NPROCESSORS_ONLN);
    const bool here = strcmp(s->backend, "local") == 0; /* else workers are on other machines */
    long long threads = s->threads > 0 ? s->threads : n, wanted = here ? threads * s->workers : 1;
#ifdef __x86_64__
    /* without these even this program would have ended by an illegal instruction, if a part of it had used them */
    bool able = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
    if (!able)
        doctor_say(d, DOCTOR_FAULT, "processor",
                   "it lacks AVX2, FMA or BMI2, which the worker needs; use another machine");
    const char *const kind = __builtin_cpu_supports("avx512f") ? "AVX2, AVX-512" : "AVX2";
#else
    const bool able = true;
    const char *const kind = "no vector unit is demanded";
#endif
    if (able && wanted > n)
        doctor_say(d, DOCTOR_NOTE, "processor",
                   "%ld processors for %lld workers with %lld threads each; jobs.workers * jobs.threads should not "
                   "exceed the processors",
                   n, (long long)s->workers, threads);
    else if (able)
        doctor_say(d, DOCTOR_OK, "processor", "%ld of them (%s), jobs.workers %lld, threads of each %lld", n, kind,
                   (long long)s->workers, threads);
}

/* Memory that this machine, or the container or unit around this process, has. -1: not known. */
static long long memory_bytes(void)
{
    long long kib = number_after("/proc/meminfo", "MemTotal:"), all = kib < 0 ? -1 : kib * 1024;
    long long limit = number_after("/sys/fs/cgroup/memory.max", "");
    return limit > 0 && limit < all ? limit : all;
}

static void examine_memory(struct doctor *d)
{
    const struct settings *s = d->settings;
    long long all = memory_bytes(), available = number_after("/proc/meminfo", "MemAvailable:") * 1024;
    long long each = s->resident_limit_bytes > 0 ? s->resident_limit_bytes : s->volume_memory_bytes + (1LL << 30);
    const bool here = strcmp(s->backend, "local") == 0;
    long long wanted = (here ? each * s->workers : 0) + (1LL << 28);
    if (all < 0)
        doctor_say(d, DOCTOR_NOTE, "memory", "its size is not known");
    else if (wanted > all)
        doctor_say(
            d, DOCTOR_NOTE, "memory",
            "%.1f GB in all, but %lld workers may hold %.1f GB; set jobs.resident_limit_bytes or jobs.workers lower",
            (double)all / 1e9, (long long)s->workers, (double)wanted / 1e9);
    else
        doctor_say(d, DOCTOR_OK, "memory", "%.1f GB in all, %.1f GB free", (double)all / 1e9, (double)available / 1e9);
    if (s->resident_limit_bytes == 0 && s->memory_limit_bytes == 0)
        doctor_say(d, DOCTOR_NOTE, "memory",
                   "jobs.resident_limit_bytes is 0, so one job may take all of it (docs/operating.md)");
}

static void examine_descriptors(struct doctor *d)
{
    struct rlimit limit;
    long long wanted = d->settings->max_connections * 2 + 128;
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
    if (limit.rlim_max != RLIM_INFINITY && (long long)limit.rlim_max < wanted)
        doctor_say(
            d, DOCTOR_NOTE, "descriptors",
            "%lld at most for this user, %lld for server.max_connections = %lld; raise LimitNOFILE= of the unit, "
            "or set it lower",
            (long long)limit.rlim_max, wanted, (long long)d->settings->max_connections);
    else
        doctor_say(d, DOCTOR_OK, "descriptors", "enough for %lld connections", (long long)d->settings->max_connections);
}

static void examine_kernel(struct doctor *d)
{
    long landlock = syscall(SYS_landlock_create_ruleset, NULL, 0UL, LANDLOCK_CREATE_RULESET_VERSION);
    bool seccomp = prctl(PR_GET_SECCOMP, 0, 0, 0, 0) >= 0;
    if (landlock > 0 && seccomp)
        doctor_say(d, DOCTOR_OK, "kernel", "it has Landlock %ld and seccomp for the sandbox of workers", landlock);
    else
        doctor_say(d, strcmp(d->settings->sandbox, "required") == 0 ? DOCTOR_FAULT : DOCTOR_NOTE, "kernel",
                   "it lacks %s, so workers have no whole sandbox (docs/safety.md)",
                   landlock > 0 ? "seccomp" : "Landlock");
}

static void examine_clock(struct doctor *d)
{
    struct timex t = {.modes = 0};
    int state = adjtimex(&t);
    double now = clock_wall_s();
    if (now < least_wall_s)
        doctor_say(d, DOCTOR_FAULT, "clock", "it is before 2024; set it, for example by chrony or systemd-timesyncd");
    else if (state == TIME_ERROR || (state >= 0 && (t.status & STA_UNSYNC) != 0))
        doctor_say(
            d, DOCTOR_NOTE, "clock",
            "no time service keeps it right, so the age of jobs may be wrong; install chrony or systemd-timesyncd");
    else
        doctor_say(d, DOCTOR_OK, "clock", "it is kept right by a time service");
}

void doctor_examine_machine(struct doctor *d)
{
    examine_processor(d);
    examine_memory(d);
    examine_descriptors(d);
    examine_kernel(d);
    examine_clock(d);
}
