#include "optimizer/worker/sandbox/sandbox_files.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

/* Definitions that Debian 12's header of Linux 6.1 lacks; values of the kernel's interface, which never change. */
enum { ACCESS_TRUNCATE = 1 << 14, ACCESS_IOCTL_DEV = 1 << 15, ACCESS_NET_TCP = 3, SCOPE_SOCKET_AND_SIGNAL = 3 };
struct ruleset {
    uint64_t handled_access_fs, handled_access_net, scoped;
};

enum { FILE_READ = LANDLOCK_ACCESS_FS_READ_FILE, FOLDER_READ = FILE_READ | LANDLOCK_ACCESS_FS_READ_DIR };

static int create(const struct ruleset *r, size_t n_bytes, unsigned flags)
{
    return (int)syscall(SYS_landlock_create_ruleset, r, n_bytes, flags);
}

/* Every right that a version of Landlock knows. An older kernel refuses a set with unknown ones. */
static struct ruleset everything(int version, size_t *n_bytes)
{
    struct ruleset r = {.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1};
    if (version >= 2) r.handled_access_fs |= LANDLOCK_ACCESS_FS_REFER;
    if (version >= 3) r.handled_access_fs |= ACCESS_TRUNCATE;
    if (version >= 4) r.handled_access_net = ACCESS_NET_TCP;
    if (version >= 5) r.handled_access_fs |= ACCESS_IOCTL_DEV;
    if (version >= 6) r.scoped = SCOPE_SOCKET_AND_SIGNAL;
    *n_bytes = version >= 6 ? sizeof r : version >= 4 ? 2 * sizeof(uint64_t) : sizeof(uint64_t);
    return r;
}

static uint64_t rights_of(enum sandbox_right right, bool folder, uint64_t handled)
{
    const uint64_t file = FILE_READ | LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_WRITE_FILE | ACCESS_TRUNCATE;
    const uint64_t of[] = {[SANDBOX_READ] = FOLDER_READ,
                           [SANDBOX_EXECUTE] = FOLDER_READ | LANDLOCK_ACCESS_FS_EXECUTE,
                           [SANDBOX_OVERWRITE] = FOLDER_READ | LANDLOCK_ACCESS_FS_WRITE_FILE | ACCESS_TRUNCATE,
                           [SANDBOX_OWN] = ~(uint64_t)(LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_MAKE_CHAR |
                                                       LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SOCK |
                                                       LANDLOCK_ACCESS_FS_MAKE_SYM | LANDLOCK_ACCESS_FS_MAKE_FIFO |
                                                       ACCESS_IOCTL_DEV)};
    return of[right] & handled & (folder ? ~(uint64_t)0 : file);
}

static status permit(int ruleset, uint64_t handled, const struct sandbox_path *p, struct error *err)
{
    struct stat st;
    int fd = open(p->path, O_PATH | O_CLOEXEC);
    if (fd < 0) return STATUS_OK;
    status s = STATUS_OK;
    bool folder = fstat(fd, &st) == 0 && S_ISDIR(st.st_mode);
    struct landlock_path_beneath_attr rule = {.allowed_access = rights_of(p->right, folder, handled), .parent_fd = fd};
    if (syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0U) != 0)
        s = error_set_errno(err, "cannot permit '%s' to the sandbox", p->path);
    close(fd);
    return s;
}

status sandbox_files_restrict(const struct sandbox_path *path, size_t n, int *version, struct error *err)
{
    size_t n_bytes;
    *version = create(NULL, 0, LANDLOCK_CREATE_RULESET_VERSION);
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return error_set_errno(err, "cannot give up privileges");
    if (*version < 1) {
        *version = 0;
        return STATUS_OK;
    }
    struct ruleset r = everything(*version, &n_bytes);
    int fd = create(&r, n_bytes, 0);
    if (fd < 0) return error_set_errno(err, "cannot make a sandbox");
    status s = STATUS_OK;
    for (size_t i = 0; i < n && s == STATUS_OK; i++) s = permit(fd, r.handled_access_fs, &path[i], err);
    if (s == STATUS_OK && syscall(SYS_landlock_restrict_self, fd, 0U) != 0)
        s = error_set_errno(err, "cannot enter the sandbox");
    close(fd);
    return s;
}

void sandbox_files_drop_capabilities(void)
{
    struct __user_cap_header_struct header = {.version = _LINUX_CAPABILITY_VERSION_3};
    struct __user_cap_data_struct none[_LINUX_CAPABILITY_U32S_3] = {{0}};
    if (syscall(SYS_capset, &header, none) != 0) return; /* a process may always have less than it has */
}
