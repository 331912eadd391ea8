#include "server/jobs/disk_reserve.h"
#include "server/jobs/job_service.h"
#include "server/settings/job_paths.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

/* A start makes a file of shared memory of 32 KiB and a WAL, and a deletion writes some pages of 4 KiB. */
enum { SMALL_BYTES = 1 << 20, LEAST_BYTES = 1 << 16, BLOCK_BYTES = 4096 };

/* The size that the file should have, at least its present one. */
static int64_t size_wanted(const struct settings *s, int64_t present_bytes, int64_t free_bytes, bool all)
{
    int64_t above = free_bytes - s->floor_bytes - s->floor_bytes / 10, wanted = present_bytes + above / 2;
    const int64_t least = all ? LEAST_BYTES : SMALL_BYTES;
    if (wanted < SMALL_BYTES) {
        wanted = present_bytes + (all ? free_bytes : free_bytes / 2);
        if (wanted > SMALL_BYTES) wanted = SMALL_BYTES;
        if (wanted < least) wanted = 0;
    }
    const int64_t most = s->ballast_bytes > SMALL_BYTES ? s->ballast_bytes : SMALL_BYTES;
    if (wanted > most) wanted = most;
    wanted -= wanted % BLOCK_BYTES;
    return wanted > present_bytes ? wanted : present_bytes;
}

void disk_reserve_keep(const struct settings *s, bool all)
{
    char path[PATH_BYTES];
    struct stat st = {0};
    long long free_bytes = 0;
    path_join(path, s->data, "ballast", NULL);
    if (path_free_bytes(s->data, &free_bytes, NULL) != STATUS_OK) return;
    if (lstat(path, &st) == 0 && !S_ISREG(st.st_mode)) return;
    int64_t present = (int64_t)st.st_size, wanted = size_wanted(s, present, free_bytes, all);
    if (wanted == present) return;
    int fd = open(path, O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (fd < 0) return;
    bool made = fallocate(fd, 0, 0, (off_t)wanted) == 0;
    if (!made && present > 0) made = ftruncate(fd, (off_t)present) == 0;
    close(fd);
    if (!made) unlink(path);
}

bool disk_reserve_release(const char *data_folder)
{
    char path[PATH_BYTES];
    path_join(path, data_folder, "ballast", NULL);
    return unlink(path) == 0;
}

bool disk_reserve_make_room(struct job_service *v, int *step)
{
    if (*step > 1 || ((*step)++ == 1 && !disk_reserve_release(v->settings->data))) return false;
    store_make_room(v->store);
    return true;
}
