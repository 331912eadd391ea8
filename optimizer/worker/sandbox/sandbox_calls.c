#include "optimizer/worker/sandbox/sandbox_calls.h"

#include "base/files/reading_note.h"

#include <errno.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>

/* Calls of libc, the thread pools and the libraries of a worker. Landlock decides which files may be opened. */
static const char *const needed[] = {
    /* files */
    "read", "write", "readv", "writev", "pread64", "pwrite64", "preadv", "pwritev", "open", "openat", "creat", "close",
    "close_range", "lseek", "_llseek", "fstat", "stat", "lstat", "newfstatat", "statx", "fstatfs", "statfs", "access",
    "faccessat", "faccessat2", "fsync", "fdatasync", "sync_file_range", "ftruncate", "fallocate", "fadvise64",
    "readahead", "flock", "fcntl", "dup", "dup2", "dup3", "pipe", "pipe2", "poll", "ppoll", "select", "pselect6",
    "rename", "renameat", "renameat2", "unlink", "unlinkat", "rmdir", "mkdir", "mkdirat", "link", "linkat", "readlink",
    "readlinkat", "getdents", "getdents64", "getcwd", "copy_file_range", "sendfile", "umask",
    /* memory */
    "brk", "mmap", "mmap2", "munmap", "mremap", "mprotect", "madvise", "msync", "mincore", "mlock", "munlock",
    "get_mempolicy", "mbind", "membarrier",
    /* threads and signals */
    "futex", "futex_waitv", "set_robust_list", "get_robust_list", "set_tid_address", "rseq", "arch_prctl", "gettid",
    "sched_yield", "sched_getaffinity", "sched_setaffinity", "sched_getparam", "sched_getscheduler",
    "sched_get_priority_max", "sched_get_priority_min", "getcpu", "rt_sigaction", "rt_sigprocmask", "rt_sigreturn",
    "rt_sigtimedwait", "rt_sigpending", "rt_sigsuspend", "sigaltstack", "restart_syscall", "exit", "exit_group",
    "wait4", "waitid",
    /* time, and questions of a process about itself */
    "clock_gettime", "clock_getres", "clock_nanosleep", "nanosleep", "gettimeofday", "time", "times", "getrusage",
    "getpid", "getppid", "getpgrp", "getpgid", "getsid", "getuid", "geteuid", "getgid", "getegid", "getresuid",
    "getresgid", "getgroups", "getpriority", "getrlimit", "sysinfo", "uname", "getrandom"};

/* Calls that nothing in a worker makes, but code that has taken it over would. */
static const char *const hostile[] = {"execve",
                                      "execveat",
                                      "fork",
                                      "vfork",
                                      "ptrace",
                                      "process_vm_readv",
                                      "process_vm_writev",
                                      "process_madvise",
                                      "pidfd_open",
                                      "pidfd_getfd",
                                      "pidfd_send_signal",
                                      "tkill",
                                      "rt_sigqueueinfo",
                                      "rt_tgsigqueueinfo",
                                      "kcmp",
                                      "socket",
                                      "socketpair",
                                      "connect",
                                      "bind",
                                      "listen",
                                      "accept",
                                      "accept4",
                                      "sendto",
                                      "sendmsg",
                                      "sendmmsg",
                                      "recvfrom",
                                      "recvmsg",
                                      "recvmmsg",
                                      "socketcall",
                                      "io_uring_setup",
                                      "io_uring_enter",
                                      "io_uring_register",
                                      "mount",
                                      "umount",
                                      "umount2",
                                      "move_mount",
                                      "open_tree",
                                      "fsopen",
                                      "fsconfig",
                                      "fsmount",
                                      "mount_setattr",
                                      "pivot_root",
                                      "chroot",
                                      "setns",
                                      "unshare",
                                      "bpf",
                                      "perf_event_open",
                                      "userfaultfd",
                                      "keyctl",
                                      "add_key",
                                      "request_key",
                                      "init_module",
                                      "finit_module",
                                      "delete_module",
                                      "kexec_load",
                                      "kexec_file_load",
                                      "reboot",
                                      "swapon",
                                      "swapoff",
                                      "acct",
                                      "quotactl",
                                      "quotactl_fd",
                                      "settimeofday",
                                      "clock_settime",
                                      "clock_adjtime",
                                      "adjtimex",
                                      "sethostname",
                                      "setdomainname",
                                      "setuid",
                                      "setgid",
                                      "setreuid",
                                      "setregid",
                                      "setresuid",
                                      "setresgid",
                                      "setfsuid",
                                      "setfsgid",
                                      "setgroups",
                                      "capset",
                                      "iopl",
                                      "ioperm",
                                      "modify_ldt",
                                      "open_by_handle_at",
                                      "fanotify_init",
                                      "mknod",
                                      "mknodat",
                                      "chmod",
                                      "fchmodat",
                                      "chown",
                                      "lchown",
                                      "fchownat",
                                      "setxattr",
                                      "lsetxattr",
                                      "truncate",
                                      "shmget",
                                      "shmat",
                                      "msgget",
                                      "mq_open"};

enum { N_NEEDED = sizeof needed / sizeof *needed, N_HOSTILE = sizeof hostile / sizeof *hostile };

static const char *name_of(int number)
{
    static const char *const special[] = {"clone", "kill", "tgkill"};
    for (size_t i = 0; i < sizeof special / sizeof *special; i++)
        if (seccomp_syscall_resolve_name(special[i]) == number) return special[i];
    for (size_t i = 0; i < N_HOSTILE; i++)
        if (seccomp_syscall_resolve_name(hostile[i]) == number) return hostile[i];
    return "unknown";
}

/* Only calls that may be made in a signal handler: libseccomp resolves a name without memory or locks. */
static void report(int signal_number, siginfo_t *info, void *context)
{
    (void)context;
    char text[600];
    const char *const part[] = {"selvedge-worker: the sandbox forbids the system call '", name_of(info->si_syscall),
                                "'", reading_note_text(), "\n"};
    size_t n = 0;
    for (size_t i = 0; i < sizeof part / sizeof *part; i++)
        for (const char *c = part[i]; *c != '\0' && n < sizeof text; c++) text[n++] = *c;
    if (write(STDERR_FILENO, text, n) < 0) {
        /* nothing else can be done */
    }
    signal(signal_number, SIG_DFL);
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, signal_number);
    pthread_sigmask(SIG_UNBLOCK, &set, NULL);
    raise(signal_number); /* to this thread: another one might not take it before the next line */
    _exit(128 + SIGSYS);
}

/* Adds a rule for a call by name. A call that this architecture lacks needs none. */
static int add(scmp_filter_ctx filter, uint32_t action, const char *name)
{
    int number = seccomp_syscall_resolve_name(name);
    return number == __NR_SCMP_ERROR ? 0 : seccomp_rule_add(filter, action, number, 0);
}

static int add_list(scmp_filter_ctx filter, uint32_t action, const char *const *name, size_t n)
{
    int r = 0;
    for (size_t i = 0; i < n && r == 0; i++) r = add(filter, action, name[i]);
    return r;
}

/* Calls that are permitted with certain arguments only. */
static int add_special(scmp_filter_ctx f)
{
    const scmp_datum_t self = (scmp_datum_t)getpid(), thread = CLONE_THREAD;
    int r = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(clone), 1, SCMP_A0(SCMP_CMP_MASKED_EQ, thread, thread));
    if (r == 0) r = seccomp_rule_add(f, SCMP_ACT_TRAP, SCMP_SYS(clone), 1, SCMP_A0(SCMP_CMP_MASKED_EQ, thread, 0));
    if (r == 0) r = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(kill), 1, SCMP_A0(SCMP_CMP_EQ, self));
    if (r == 0) r = seccomp_rule_add(f, SCMP_ACT_TRAP, SCMP_SYS(kill), 1, SCMP_A0(SCMP_CMP_NE, self));
    if (r == 0) r = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1, SCMP_A0(SCMP_CMP_EQ, self));
    if (r == 0) r = seccomp_rule_add(f, SCMP_ACT_TRAP, SCMP_SYS(tgkill), 1, SCMP_A0(SCMP_CMP_NE, self));
    /* limits may be read; the last but one argument would set them */
    if (r == 0) r = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(prlimit64), 1, SCMP_A2(SCMP_CMP_EQ, 0));
    if (r == 0)
        r = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(prctl), 1, SCMP_A0(SCMP_CMP_EQ, (scmp_datum_t)PR_SET_NAME));
    /* whether a descriptor is a terminal: there is none */
    if (r == 0) r = seccomp_rule_add(f, SCMP_ACT_ERRNO(ENOTTY), SCMP_SYS(ioctl), 0);
    return r;
}

/* Loads a filter for all threads. Kernels before 3.17 and some containers have no seccomp. */
static status load(scmp_filter_ctx filter, int r, bool *restricted, struct error *err)
{
    if (r == 0) r = seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
    if (r == 0) r = seccomp_attr_set(filter, SCMP_FLTATR_CTL_OPTIMIZE, 2);
    if (r == 0) r = seccomp_attr_set(filter, SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_KILL_PROCESS);
    if (r != 0) {
        errno = -r;
        return error_set_errno(err, "cannot make a filter of system calls");
    }
    *restricted = seccomp_load(filter) == 0;
    return STATUS_OK;
}

status sandbox_calls_of_worker(bool *restricted, struct error *err)
{
    *restricted = false;
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(ENOSYS));
    if (filter == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a filter of system calls: out of memory");
    struct sigaction action = {.sa_sigaction = report, .sa_flags = SA_SIGINFO};
    sigaction(SIGSYS, &action, NULL);
    int r = add_list(filter, SCMP_ACT_ALLOW, needed, N_NEEDED);
    if (r == 0) r = add_list(filter, SCMP_ACT_TRAP, hostile, N_HOSTILE);
    if (r == 0) r = add_special(filter);
    status s = load(filter, r, restricted, err);
    seccomp_release(filter);
    return s;
}

status sandbox_calls_of_program(bool *restricted, struct error *err)
{
    static const char *const no[] = {"socket",        "socketpair", "ptrace", "process_vm_readv", "process_vm_writev",
                                     "kill",          "tkill",      "tgkill", "pidfd_open",       "pidfd_send_signal",
                                     "io_uring_setup"};
    *restricted = false;
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    if (filter == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a filter of system calls: out of memory");
    int r = add_list(filter, SCMP_ACT_ERRNO(EPERM), no, sizeof no / sizeof *no);
    status s = load(filter, r, restricted, err);
    seccomp_release(filter);
    return s;
}
