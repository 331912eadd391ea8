/* A folder is emptied from its upper two levels: folders of the third level are first moved up to the first one, so
 * each folder is opened at this level and nothing ever goes down a path. */
#include "base/files/file_tree.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <fts.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MOVED_NAME_BYTES = 40, BLOCK_BYTES = 512 };

/* Opens a folder that is to be emptied. The program that wrote it may have taken the owner's permissions away. */
static DIR *open_folder(int parent_fd, const char *name)
{
    const int how = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;
    struct stat st;
    int fd = openat(parent_fd, name, how);
    if (fd < 0 && errno == EACCES && fchmodat(parent_fd, name, S_IRWXU, AT_SYMLINK_NOFOLLOW) == 0)
        fd = openat(parent_fd, name, how);
    if (fd < 0) return NULL;
    if (fstat(fd, &st) == 0 && (st.st_mode & S_IRWXU) != S_IRWXU) fchmod(fd, S_IRWXU);
    DIR *d = fdopendir(fd);
    if (d == NULL) {
        int e = errno;
        close(fd);
        errno = e;
    }
    return d;
}

/* The next entry other than "." and ".."; NULL at the end, and then errno is 0 unless reading failed. */
static const char *next_name(DIR *d)
{
    const struct dirent *entry;
    do {
        errno = 0;
        entry = readdir(d);
    } while (entry != NULL && (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0));
    return entry == NULL ? NULL : entry->d_name;
}

/* Removes a file, a link or an empty folder. Returns 0, ENOTEMPTY for a folder that is not empty, or another errno. */
static int remove_flat(int folder_fd, const char *name)
{
    if (unlinkat(folder_fd, name, 0) == 0 || errno == ENOENT) return 0;
    if (errno != EISDIR && errno != EPERM) return errno;
    if (unlinkat(folder_fd, name, AT_REMOVEDIR) == 0 || errno == ENOENT) return 0;
    return errno == EEXIST ? ENOTEMPTY : errno;
}

/* Moves a folder into `top` under a name that is free there. To be moved it must be writable. */
static int move_up(int folder_fd, const char *name, int top_fd, unsigned long *n_moved)
{
    char free_name[MOVED_NAME_BYTES];
    int e;
    do {
        snprintf(free_name, sizeof free_name, "moved-%lu", ++*n_moved);
        if (renameat(folder_fd, name, top_fd, free_name) == 0) return 0;
        e = errno;
        if (e == EACCES && fchmodat(folder_fd, name, S_IRWXU, AT_SYMLINK_NOFOLLOW) == 0 &&
            renameat(folder_fd, name, top_fd, free_name) == 0)
            return 0;
    } while (e == ENOTEMPTY || e == EEXIST || e == ENOTDIR);
    return e;
}

/* Removes a folder of `top`; the folders in it that are not empty come into `top`. */
static int remove_second(int top_fd, const char *name, unsigned long *n_moved)
{
    DIR *d = open_folder(top_fd, name);
    if (d == NULL) return errno;
    int e = 0;
    for (const char *inner; e == 0 && (inner = next_name(d)) != NULL;) {
        e = remove_flat(dirfd(d), inner);
        if (e == ENOTEMPTY) e = move_up(dirfd(d), inner, top_fd, n_moved);
    }
    if (e == 0) e = errno;
    closedir(d);
    return e == 0 ? remove_flat(top_fd, name) : e;
}

/* Returns 0 or errno. */
static int empty(DIR *top)
{
    unsigned long n_moved = 0, n_before;
    int e = 0;
    do {
        n_before = n_moved;
        rewinddir(top);
        for (const char *name; e == 0 && (name = next_name(top)) != NULL;) {
            e = remove_flat(dirfd(top), name);
            if (e == ENOTEMPTY) e = remove_second(dirfd(top), name, &n_moved);
        }
        if (e == 0) e = errno;
    } while (e == 0 && n_moved > n_before);
    return e;
}

static int empty_at(const char *path)
{
    DIR *top = open_folder(AT_FDCWD, path);
    if (top == NULL) return errno;
    int e = empty(top);
    closedir(top);
    return e;
}

status file_tree_remove(const char *path, struct error *err)
{
    int e = remove_flat(AT_FDCWD, path);
    if (e == ENOTEMPTY) e = empty_at(path);
    if (e == 0) e = remove_flat(AT_FDCWD, path);
    if (e == 0) return STATUS_OK;
    errno = e;
    return error_set_errno(err, "cannot remove '%s'", path);
}

typedef int64_t entry_bytes(const FTSENT *e);

static int64_t sum_of(const char *path, entry_bytes *bytes)
{
    char *root[] = {(char *)(uintptr_t)path, NULL};
    int64_t sum = 0;
    FTS *tree = fts_open(root, FTS_PHYSICAL | FTS_NOCHDIR, NULL);
    if (tree == NULL) return 0;
    for (FTSENT *e; (e = fts_read(tree)) != NULL;)
        if (e->fts_info == FTS_F || e->fts_info == FTS_D) sum += bytes(e);
    fts_close(tree);
    return sum;
}

static int64_t stored_bytes(const FTSENT *e)
{
    return (int64_t)e->fts_statp->st_blocks * BLOCK_BYTES /
           (e->fts_info == FTS_F && e->fts_statp->st_nlink > 1 ? (int64_t)e->fts_statp->st_nlink : 1);
}

static int64_t content_bytes(const FTSENT *e) { return e->fts_info == FTS_F ? (int64_t)e->fts_statp->st_size : 0; }

int64_t disk_use_bytes(const char *path) { return sum_of(path, stored_bytes); }
int64_t disk_content_bytes(const char *path) { return sum_of(path, content_bytes); }
