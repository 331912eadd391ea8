#include "server/files/upload_file.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "server/settings/job_paths.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

static const char seal_name[] = "user.selvedge.sha256";

_Static_assert(sizeof(crypto_hash_sha256_state) <= STORE_HASH_STATE_BYTES, "the hash state fits its column");

void upload_part_path(const char *data, const struct file_row *row, char out[PATH_BYTES])
{
    path_join(out, data, "jobs", row->job_id, "upload", row->id, NULL);
}

void upload_input_path(const char *data, const struct file_row *row, char out[PATH_BYTES])
{
    path_join(out, data, "jobs", row->job_id, JOB_FOLDER_INPUT, row->name, NULL);
}

void upload_hash_restart(struct file_row *row)
{
    crypto_hash_sha256_state state;
    memset(&state, 0, sizeof state);
    crypto_hash_sha256_init(&state);
    memset(row->hash_state, 0, sizeof row->hash_state);
    memcpy(row->hash_state, &state, sizeof state);
}

/* Makes the file of an upload with its space; *fd stays open. */
static status reserve_one(const char *data, struct file_row *row, int *fd, struct error *err)
{
    char path[PATH_BYTES];
    upload_part_path(data, row, path);
    *fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (*fd < 0) return error_set_errno(err, "cannot make room for '%s'", row->name);
    row->offset_bytes = 0;
    row->state = FILE_UPLOADING;
    upload_hash_restart(row);
    /* not posix_fallocate(), which writes every block of a file on file systems that cannot reserve space */
    if (fallocate(*fd, 0, 0, (off_t)row->size_bytes) == 0 || errno == EOPNOTSUPP) return STATUS_OK;
    return errno == EFBIG ? error_set(err, STATUS_DISK_FULL,
                                      "cannot make room for '%s': the file system does not support files of %lld bytes",
                                      row->name, (long long)row->size_bytes)
                          : error_set_errno(err, "cannot make room for the %lld bytes of '%s'",
                                            (long long)row->size_bytes, row->name);
}

status upload_reserve(const char *data, struct file_row *row, size_t n, struct error *err)
{
    char path[PATH_BYTES];
    status s = STATUS_OK;
    size_t i = 0;
    for (; s == STATUS_OK && i < n; i++) {
        int fd = -1;
        s = reserve_one(data, &row[i], &fd, err);
        /* the last one for all: their space is metadata, which file systems write in order */
        if (s == STATUS_OK && i + 1 == n && fsync(fd) != 0)
            s = error_set_errno(err, "cannot make room for '%s'", row[i].name);
        if (fd >= 0) close(fd);
    }
    upload_part_path(data, &row[0], path);
    if (s == STATUS_OK) s = durable_sync_folder_of(path, err);
    for (size_t k = 0; s != STATUS_OK && k < i; k++) {
        upload_part_path(data, &row[k], path);
        unlink(path);
    }
    return s;
}

/* Failures are no errors: files without a seal are only not shared. */
static void seal(const char *path, const struct file_row *row)
{
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return;
    if (fchmod(fd, S_IRUSR) == 0) fsetxattr(fd, seal_name, row->sha256, strlen(row->sha256), 0);
    close(fd);
}

bool upload_is_sealed(const char *path, const struct file_row *row)
{
    char text[STORE_HASH_TEXT_BYTES];
    struct stat st;
    ssize_t n = lgetxattr(path, seal_name, text, sizeof text);
    return n > 0 && (size_t)n == strlen(row->sha256) && memcmp(text, row->sha256, (size_t)n) == 0 &&
           lstat(path, &st) == 0 && S_ISREG(st.st_mode) && (st.st_mode & ALLPERMS) == S_IRUSR;
}

status upload_move_to_place(struct store *store, const char *data, struct file_row *row, struct error *err)
{
    char from[PATH_BYTES], to[PATH_BYTES];
    upload_part_path(data, row, from);
    upload_input_path(data, row, to);
    seal(from, row);
    if (rename(from, to) != 0 && !(errno == ENOENT && access(to, R_OK) == 0))
        return error_set_errno(err, "cannot move '%s' to its place", row->name);
    status s = durable_sync_folder_of(to, err);
    if (s == STATUS_OK) s = durable_sync_folder_of(from, err);
    if (s != STATUS_OK) return s;
    row->state = FILE_COMPLETE;
    return store_file_update(store, row, err);
}
