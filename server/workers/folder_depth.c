#include "server/workers/folder_depth.h"

#include <dirent.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool is_folder(int folder_fd, const struct dirent *e)
{
    struct stat st;
    if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) return false;
    if (e->d_type != DT_UNKNOWN) return e->d_type == DT_DIR;
    return fstatat(folder_fd, e->d_name, &st, AT_SYMLINK_NOFOLLOW) == 0 && S_ISDIR(st.st_mode);
}

/* Takes ownership of folder_fd. Calls itself `left` times at the most. */
static bool is_deeper(int folder_fd, int64_t left)
{
    bool deeper = false;
    DIR *d = folder_fd < 0 ? NULL : fdopendir(folder_fd);
    if (d == NULL && folder_fd >= 0) close(folder_fd);
    if (d == NULL) return false; /* it was removed meanwhile */
    for (struct dirent *e; !deeper && (e = readdir(d)) != NULL;) {
        if (!is_folder(dirfd(d), e)) continue;
        deeper = left == 0 ||
                 is_deeper(openat(dirfd(d), e->d_name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC), left - 1);
    }
    closedir(d);
    return deeper;
}

bool folder_is_deeper(const char *path, int64_t most)
{
    return is_deeper(open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC), most);
}
