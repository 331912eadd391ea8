/* System calls of a restricted worker and of the program that it starts: permitted, refused with an error, or the end
 * of the process with a line that names the call. Each act runs in a process of its own. */
#include "optimizer/worker/sandbox/sandbox_calls.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

static pid_t parent;

/* Each returns the result of the call: 0 or more, or -1 with errno. */
static long make_socket(void) { return socket(AF_INET, SOCK_STREAM, 0); }
static long start_process(void) { return syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0); }
static long start_program(void) { return execl("/bin/true", "true", (char *)NULL); }
static long change_mode(void) { return chmod("/tmp", 01777); }
static long signal_parent(void) { return kill(parent, 0); }
static long signal_group(void) { return kill(0, 0); }
static long signal_own(void) { return kill(getpid(), 0); }
static long signal_thread_of_parent(void) { return syscall(SYS_tgkill, parent, parent, 0); }
static long signal_own_thread(void) { return syscall(SYS_tgkill, getpid(), gettid(), 0); }
static long trace_parent(void) { return syscall(SYS_ptrace, 16, parent, 0, 0); }
static long ask_terminal(void) { return ioctl(0, TIOCGWINSZ, &(struct winsize){0}); }
static long unknown_call(void) { return syscall(SYS_personality, 0xffffffff); }
static long name_thread(void) { return prctl(PR_SET_NAME, "other", 0, 0, 0); }
static long dump(void) { return prctl(PR_SET_DUMPABLE, 1, 0, 0, 0); }
static long own_file(void) { return open("/dev/null", O_RDONLY); }

static long read_limit(void)
{
    struct rlimit l;
    return syscall(SYS_prlimit64, 0, RLIMIT_NOFILE, NULL, &l);
}

static long set_limit(void)
{
    struct rlimit l = {100, 100};
    return syscall(SYS_prlimit64, 0, RLIMIT_NOFILE, &l, NULL);
}

static void *nothing(void *context) { return context; }

static long start_thread(void)
{
    pthread_t t;
    errno = pthread_create(&t, NULL, nothing, NULL);
    return errno == 0 ? pthread_join(t, NULL) : -1;
}

enum { ENDED = -1, PERMITTED = 0 }; /* or the errno of a refusal */

struct act {
    const char *name; /* of the call, as the line on stderr has it */
    long (*run)(void);
    int worker, program; /* what is to become of it */
};

static const struct act act[] = {
    {"socket", make_socket, ENDED, EPERM},           {"clone", start_process, ENDED, PERMITTED},
    {"execve", start_program, ENDED, PERMITTED},     {"chmod", change_mode, ENDED, PERMITTED},
    {"kill", signal_parent, ENDED, EPERM},           {"kill", signal_group, ENDED, EPERM},
    {"kill", signal_own, PERMITTED, EPERM},          {"tgkill", signal_thread_of_parent, ENDED, EPERM},
    {"tgkill", signal_own_thread, PERMITTED, EPERM}, {"ptrace", trace_parent, ENDED, EPERM},
    {"ioctl", ask_terminal, ENOTTY, ENOTTY},         {"personality", unknown_call, ENOSYS, PERMITTED},
    {"prctl", name_thread, PERMITTED, PERMITTED},    {"prctl", dump, ENOSYS, PERMITTED},
    {"prlimit64", read_limit, PERMITTED, PERMITTED}, {"prlimit64", set_limit, ENOSYS, PERMITTED},
    {"open", own_file, PERMITTED, PERMITTED},        {"clone", start_thread, PERMITTED, PERMITTED},
};

typedef status restriction(bool *restricted, struct error *err);

/* Runs f in a restricted process; text gets what it says on stderr. Returns the exit code, or -signal. */
static int restricted(restriction *restrict_calls, int (*f)(const void *), const void *context, char text[400])
{
    int out[2], code;
    assert_int_equal(pipe(out), 0);
    pid_t pid = fork();
    if (pid == 0) {
        bool done = false;
        int null = open("/dev/null", O_RDONLY);
        dup2(null, 0);
        dup2(out[1], 2);
        close(out[1]);
        if (restrict_calls(&done, NULL) != STATUS_OK || !done) _exit(200);
        _exit(f(context));
    }
    close(out[1]);
    size_t n = 0;
    for (ssize_t got; n < 399 && (got = read(out[0], text + n, 399 - n)) > 0;) n += (size_t)got;
    text[n] = '\0';
    close(out[0]);
    waitpid(pid, &code, 0);
    return WIFSIGNALED(code) ? -WTERMSIG(code) : WEXITSTATUS(code);
}

static int run_act(const void *context)
{
    const struct act *a = context;
    errno = 0;
    return a->run() >= 0 ? 0 : errno;
}

static void check(restriction *restrict_calls, const struct act *a, int want, bool says)
{
    char text[400], line[200];
    int got = restricted(restrict_calls, run_act, a, text);
    snprintf(line, sizeof line, "selvedge-worker: the sandbox forbids the system call '%s'\n", a->name);
    if (want == ENDED ? got != -SIGSYS : got != want) fail_msg("%s: %d, not %d; %s", a->name, got, want, text);
    if (strcmp(text, want == ENDED && says ? line : "") != 0) fail_msg("%s: it says '%s'", a->name, text);
}

static void test_worker(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof act / sizeof *act; i++) check(sandbox_calls_of_worker, &act[i], act[i].worker, true);
}

static void test_program(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof act / sizeof *act; i++)
        check(sandbox_calls_of_program, &act[i], act[i].program, false);
}

/* A thread that runs before the restriction is restricted too. */
static sem_t begun, go;

static void *waits(void *context)
{
    sem_post(&begun);
    sem_wait(&go);
    make_socket();
    return context;
}

static status restrict_beside_a_thread(bool *done, struct error *err)
{
    pthread_t t;
    sem_init(&begun, 0, 0);
    sem_init(&go, 0, 0);
    if (pthread_create(&t, NULL, waits, NULL) != 0) return STATUS_IO;
    sem_wait(&begun);
    return sandbox_calls_of_worker(done, err);
}

static int let_the_thread_go(const void *context)
{
    (void)context;
    sem_post(&go);
    for (int i = 0; i < 200; i++) nanosleep(&(struct timespec){0, 10000000}, NULL);
    return 0;
}

static void test_threads_that_run_already(void **state)
{
    char text[400];
    (void)state;
    assert_int_equal(restricted(restrict_beside_a_thread, let_the_thread_go, NULL, text), -SIGSYS);
    assert_non_null(strstr(text, "'socket'"));
}

#ifdef __x86_64__
/* The numbers of 32-bit calls mean other calls: 20 is getpid there, and writev here. */
static int call_as_32_bit(const void *context)
{
    int result = 20;
    (void)context;
    __asm__ volatile("int $0x80" : "+a"(result) : : "memory", "r8", "r9", "r10", "r11");
    return 0;
}

static void *call_from_a_thread(void *context)
{
    call_as_32_bit(context);
    return context;
}

/* The other threads end, too. */
static int call_beside_this_thread(const void *context)
{
    pthread_t t;
    (void)context;
    if (pthread_create(&t, NULL, call_from_a_thread, NULL) != 0) return 201;
    for (int i = 0; i < 100; i++) nanosleep(&(struct timespec){0, 10000000}, NULL);
    return 0;
}

static void test_calls_of_another_architecture(void **state)
{
    char text[400];
    (void)state;
    assert_int_equal(restricted(sandbox_calls_of_worker, call_as_32_bit, NULL, text), -SIGSYS);
    assert_string_equal(text, "");
    assert_int_equal(restricted(sandbox_calls_of_worker, call_beside_this_thread, NULL, text), -SIGSYS);
}
#endif

/* A handler for the signal that is the answer to a forbidden call must not let the process go on. */
static int ignore_the_signal(const void *context)
{
    (void)context;
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGSYS);
    sigprocmask(SIG_BLOCK, &set, NULL);
    make_socket();
    return 0;
}

static void test_the_signal_cannot_be_blocked(void **state)
{
    char text[400];
    (void)state;
    assert_int_equal(restricted(sandbox_calls_of_worker, ignore_the_signal, NULL, text), -SIGSYS);
}

int main(void)
{
    bool done = false;
    parent = getpid();
    pid_t pid = fork();
    if (pid == 0) _exit(sandbox_calls_of_worker(&done, NULL) != STATUS_OK ? 2 : done ? 0 : 1);
    int code = 0;
    waitpid(pid, &code, 0);
    if (WIFEXITED(code) && WEXITSTATUS(code) == 1) {
        print_message("the kernel has no seccomp\n");
        return 0;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_worker),
        cmocka_unit_test(test_program),
        cmocka_unit_test(test_threads_that_run_already),
#ifdef __x86_64__
        cmocka_unit_test(test_calls_of_another_architecture),
#endif
        cmocka_unit_test(test_the_signal_cannot_be_blocked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
