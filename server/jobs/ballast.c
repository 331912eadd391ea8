#include "server/jobs/ballast.h"
#include "server/jobs/job_paths.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

void ballast_keep(const char *data_folder, int64_t n_bytes)
{
    char path[PATH_BYTES];
    struct stat st;
    long long free_bytes = 0;
    path_join(path, data_folder, "ballast", NULL);
    if (n_bytes == 0 || stat(path, &st) == 0 || path_free_bytes(data_folder, &free_bytes, NULL) != STATUS_OK ||
        free_bytes < 2 * n_bytes)
        return;
    int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0) return;
    bool made = fallocate(fd, 0, 0, (off_t)n_bytes) == 0;
    close(fd);
    if (!made) unlink(path);
}

bool ballast_release(const char *data_folder)
{
    char path[PATH_BYTES];
    path_join(path, data_folder, "ballast", NULL);
    return unlink(path) == 0;
}
