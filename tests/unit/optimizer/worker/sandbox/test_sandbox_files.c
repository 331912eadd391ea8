/* What each right of the sandbox permits: a process restricts itself and tries one act after the other, on a folder
 * that it has the right to and on one that it has none to. What is not in the table must fail. */
#include "optimizer/worker/sandbox/sandbox_files.h"
#include "tests/support/scratch_folder.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* Acts on the folder's files "file", "program" and "sub/file"; each returns 0, or -1 with errno. */
static int opened(const char *folder, const char *name, int flags)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    int fd = open(path, flags | O_CLOEXEC, 0600);
    return fd < 0 ? -1 : close(fd);
}

static int read_file(const char *f) { return opened(f, "file", O_RDONLY); }
static int list_folder(const char *f) { return opened(f, "sub", O_RDONLY | O_DIRECTORY); }
static int write_file(const char *f) { return opened(f, "file", O_WRONLY); }
static int empty_file(const char *f) { return opened(f, "file", O_WRONLY | O_TRUNC); }
static int make_file(const char *f) { return opened(f, "new", O_WRONLY | O_CREAT | O_EXCL); }

static char *within(const char *folder, const char *name)
{
    static char path[2][256];
    static int i;
    i = 1 - i;
    snprintf(path[i], sizeof path[i], "%s/%s", folder, name);
    return path[i];
}

static int cut_file(const char *f) { return truncate(within(f, "file"), 1); }
static int make_folder(const char *f) { return mkdir(within(f, "made"), 0700); }
static int remove_file(const char *f) { return unlink(within(f, "file")); }
static int remove_folder(const char *f) { return rmdir(within(f, "bare")); }
static int rename_file(const char *f) { return rename(within(f, "file"), within(f, "renamed")); }
static int move_file(const char *f) { return rename(within(f, "file"), within(f, "sub/moved")); }
static int link_file(const char *f) { return link(within(f, "file"), within(f, "sub/linked")); }
static int make_link(const char *f) { return symlink("/etc/passwd", within(f, "link")); }
static int make_pipe(const char *f) { return mkfifo(within(f, "pipe"), 0600); }
static int make_character(const char *f) { return mknod(within(f, "zero"), S_IFCHR | 0600, makedev(1, 5)); }
static int make_block(const char *f) { return mknod(within(f, "disk"), S_IFBLK | 0600, makedev(7, 0)); }

static int make_socket(const char *f)
{
    struct sockaddr_un a = {.sun_family = AF_UNIX};
    snprintf(a.sun_path, sizeof a.sun_path, "%.90s/s", f);
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    return bind(fd, (struct sockaddr *)&a, sizeof a);
}

/* The device is one that root has put there. */
static int ask_device_of_folder(const char *f)
{
    int n, fd = open(within(f, "null"), O_RDONLY | O_CLOEXEC);
    return fd < 0 ? -1 : ioctl(fd, FIONREAD, &n);
}

static int run_program(const char *f)
{
    int code = 0;
    pid_t pid = fork();
    if (pid == 0) {
        execl(within(f, "program"), "program", (char *)NULL);
        _exit(errno);
    }
    waitpid(pid, &code, 0);
    errno = WEXITSTATUS(code);
    return WIFEXITED(code) && errno == 0 ? 0 : -1;
}

enum { R = 1 << SANDBOX_READ, X = 1 << SANDBOX_EXECUTE, W = 1 << SANDBOX_OVERWRITE, O = 1 << SANDBOX_OWN };

static const struct {
    const char *name;
    int (*run)(const char *folder);
    unsigned permitted; /* by these rights */
} act[] = {{"read a file", read_file, R | X | W | O},
           {"list a folder", list_folder, R | X | W | O},
           {"write to a file", write_file, W | O},
           {"empty a file", empty_file, W | O},
           {"cut a file", cut_file, W | O},
           {"execute a program", run_program, X},
           {"make a file", make_file, O},
           {"make a folder", make_folder, O},
           {"remove a file", remove_file, O},
           {"remove a folder", remove_folder, O},
           {"rename a file", rename_file, O},
           {"move a file to another folder", move_file, O},
           {"link a file to another folder", link_file, O},
           {"make a symbolic link", make_link, 0},
           {"make a pipe", make_pipe, 0},
           {"make a character device", make_character, 0},
           {"make a block device", make_block, 0},
           {"make a socket", make_socket, 0},
           {"ask a device", ask_device_of_folder, 0}};
enum { N_ACT = sizeof act / sizeof *act };

static void fill(const char *folder)
{
    char command[1024];
    snprintf(command, sizeof command,
             "rm -rf '%s' && mkdir -p '%s/sub' '%s/bare' && echo text > '%s/file' && cp /bin/true '%s/program'", folder,
             folder, folder, folder, folder);
    assert_int_equal(system(command), 0);
    if (mknod(within(folder, "null"), S_IFCHR | 0600, makedev(1, 3)) != 0) assert_int_not_equal(geteuid(), 0);
}

static void restrict_to(const struct sandbox_path *own, size_t n_own)
{
    struct sandbox_path path[8] = {
        {SANDBOX_EXECUTE, "/usr"}, {SANDBOX_EXECUTE, "/lib"}, {SANDBOX_EXECUTE, "/lib64"}, {SANDBOX_READ, "/no/such"}};
    int version = 0;
    for (size_t i = 0; i < n_own; i++) path[4 + i] = own[i];
    if (sandbox_files_restrict(path, 4 + n_own, &version, NULL) != STATUS_OK || version < 3) _exit(200);
}

/* Returns 0 where the act worked, else its errno. */
static int outcome(enum sandbox_right right, const char *permitted, const char *folder, size_t i_act)
{
    int code;
    pid_t pid = fork();
    if (pid == 0) {
        restrict_to(&(struct sandbox_path){right, permitted}, 1);
        _exit(act[i_act].run(folder) == 0 ? 0 : errno);
    }
    assert_int_equal(waitpid(pid, &code, 0), pid);
    assert_true(WIFEXITED(code) && WEXITSTATUS(code) != 200);
    return WEXITSTATUS(code);
}

static int need_landlock(void **state)
{
    int version = 0, code = 0;
    pid_t pid = fork();
    if (pid == 0) _exit(sandbox_files_restrict(NULL, 0, &version, NULL) == STATUS_OK ? version : 0);
    waitpid(pid, &code, 0);
    if (WEXITSTATUS(code) < 3) print_message("the kernel has Landlock %d, the test needs 3\n", WEXITSTATUS(code));
    *state = (void *)(uintptr_t)WEXITSTATUS(code);
    return 0;
}

static void check(const char *inside, const char *outside, enum sandbox_right right, size_t i)
{
    bool permitted = (act[i].permitted >> right & 1) != 0;
    fill(inside);
    fill(outside);
    int got = outcome(right, inside, inside, i), elsewhere = outcome(right, inside, outside, i);
    if ((got == 0) != permitted) fail_msg("right %d, %s: errno %d", right, act[i].name, got);
    if (elsewhere == 0) fail_msg("right %d, %s outside of the folder", right, act[i].name);
    if (got != 0) assert_true(got == EACCES || got == EXDEV || got == EPERM || got == ENOENT);
}

static void test_rights(void **state)
{
    if ((uintptr_t)*state < 3) skip();
    void *folder = NULL;
    scratch_folder_setup(&folder);
    char inside[200], outside[200];
    snprintf(inside, sizeof inside, "%s", scratch_path(&folder, "inside"));
    snprintf(outside, sizeof outside, "%s", scratch_path(&folder, "outside"));
    for (int right = SANDBOX_READ; right <= SANDBOX_OWN; right++)
        for (size_t i = 0; i < N_ACT; i++) check(inside, outside, (enum sandbox_right)right, i);
    scratch_folder_teardown(&folder);
}

/* A rule may name a file alone; its neighbours stay out of reach. */
static void test_a_single_file(void **state)
{
    if ((uintptr_t)*state < 3) skip();
    void *folder = NULL;
    scratch_folder_setup(&folder);
    char inside[200], file[220];
    snprintf(inside, sizeof inside, "%s", scratch_path(&folder, "inside"));
    snprintf(file, sizeof file, "%s/file", inside);
    fill(inside);
    for (size_t i = 0; i < N_ACT; i++) {
        bool of_file = act[i].run == read_file || act[i].run == write_file || act[i].run == empty_file;
        if (act[i].run == cut_file || act[i].run == remove_file || act[i].run == rename_file) continue;
        assert_int_equal(outcome(SANDBOX_READ, file, inside, i) == 0, act[i].run == read_file);
        assert_int_equal(outcome(SANDBOX_OVERWRITE, file, inside, i) == 0, of_file);
    }
    assert_int_equal(outcome(SANDBOX_OVERWRITE, file, inside, 4), 0); /* cut a file */
    assert_int_not_equal(outcome(SANDBOX_OWN, file, inside, 8), 0);   /* remove a file: its folder decides */
    scratch_folder_teardown(&folder);
}

/* Runs a function in a restricted process; returns 0 or its errno. */
static int restricted(int (*run)(void *), void *context)
{
    int code;
    pid_t pid = fork();
    if (pid == 0) {
        restrict_to(NULL, 0);
        _exit(run(context) == 0 ? 0 : errno);
    }
    waitpid(pid, &code, 0);
    return WIFEXITED(code) ? WEXITSTATUS(code) : 255;
}

static int connect_to(void *address)
{
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    return connect(fd, address, sizeof(struct sockaddr_in));
}

static int listen_at(void *address)
{
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    return bind(fd, address, sizeof(struct sockaddr_in));
}

static int signal_parent(void *unused)
{
    (void)unused;
    return kill(getppid(), 0);
}

/* A device that may be read is not asked for anything else. */
static int ask_device(enum sandbox_right right)
{
    int code, n;
    pid_t pid = fork();
    if (pid == 0) {
        restrict_to(&(struct sandbox_path){right, "/dev/null"}, 1);
        int fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
        _exit(fd < 0 ? 201 : ioctl(fd, FIONREAD, &n) == 0 ? 0 : errno);
    }
    waitpid(pid, &code, 0);
    return WIFEXITED(code) ? WEXITSTATUS(code) : 255;
}

static int connect_abstract(void *name)
{
    struct sockaddr_un a = {.sun_family = AF_UNIX};
    memcpy(a.sun_path + 1, name, strlen(name));
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    return connect(fd, (struct sockaddr *)&a, (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + strlen(name)));
}

static void test_network(void **state)
{
    if ((uintptr_t)*state < 4) skip();
    struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)}, any = a;
    socklen_t n = sizeof a;
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_true(bind(fd, (struct sockaddr *)&a, n) == 0 && listen(fd, 1) == 0);
    assert_int_equal(getsockname(fd, (struct sockaddr *)&a, &n), 0);
    assert_int_equal(connect_to(&a), 0);
    assert_int_equal(restricted(connect_to, &a), EACCES);
    assert_int_equal(restricted(listen_at, &any), EACCES);
    close(fd);
}

static void test_processes_and_sockets(void **state)
{
    if ((uintptr_t)*state < 6) skip();
    char name[40];
    struct sockaddr_un a = {.sun_family = AF_UNIX};
    snprintf(name, sizeof name, "selvedge-%d", (int)getpid());
    memcpy(a.sun_path + 1, name, strlen(name));
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    socklen_t n = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + strlen(name));
    assert_true(bind(fd, (struct sockaddr *)&a, n) == 0 && listen(fd, 2) == 0);
    assert_int_equal(connect_abstract(name), 0);
    assert_int_equal(restricted(connect_abstract, name), EPERM);
    assert_int_equal(restricted(signal_parent, NULL), EPERM);
    for (int right = SANDBOX_READ; right <= SANDBOX_OWN; right++)
        assert_int_equal(ask_device((enum sandbox_right)right), EACCES);
    close(fd);
}

static int is_privileged(void *unused)
{
    (void)unused;
    return prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1 ? 0 : -1;
}

static void test_nothing_is_gained_by_a_program(void **state)
{
    (void)state;
    assert_int_equal(restricted(is_privileged, NULL), 0);
}

/* Root reads any file by a capability; a process that has given it up does not. */
static void test_capabilities_are_given_up(void **state)
{
    if (geteuid() != 0) skip();
    void *folder = NULL;
    int code;
    scratch_folder_setup(&folder);
    const char *path = scratch_path(&folder, "secret");
    scratch_write(path, "x", 1);
    assert_int_equal(chmod(path, 0), 0);
    pid_t pid = fork();
    if (pid == 0) {
        if (open(path, O_RDONLY | O_CLOEXEC) < 0) _exit(1);
        sandbox_files_drop_capabilities();
        _exit(open(path, O_RDONLY | O_CLOEXEC) < 0 && errno == EACCES ? 0 : 2);
    }
    waitpid(pid, &code, 0);
    assert_true(WIFEXITED(code) && WEXITSTATUS(code) == 0);
    scratch_folder_teardown(&folder);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_rights, need_landlock),
        cmocka_unit_test_setup(test_a_single_file, need_landlock),
        cmocka_unit_test_setup(test_network, need_landlock),
        cmocka_unit_test_setup(test_processes_and_sockets, need_landlock),
        cmocka_unit_test_setup(test_nothing_is_gained_by_a_program, need_landlock),
        cmocka_unit_test(test_capabilities_are_given_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
