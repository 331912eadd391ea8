#include "base/files/disk_use.h"

#include <fts.h>
#include <stddef.h>
#include <sys/stat.h>

enum { BLOCK_BYTES = 512 };

int64_t disk_use_bytes(const char *path)
{
    char *root[] = {(char *)(uintptr_t)path, NULL};
    int64_t sum = 0;
    FTS *tree = fts_open(root, FTS_PHYSICAL | FTS_NOCHDIR, NULL);
    if (tree == NULL) return 0;
    for (FTSENT *e; (e = fts_read(tree)) != NULL;)
        if (e->fts_info == FTS_F || e->fts_info == FTS_D)
            sum += (int64_t)e->fts_statp->st_blocks * BLOCK_BYTES /
                   (e->fts_info == FTS_F && e->fts_statp->st_nlink > 1 ? (int64_t)e->fts_statp->st_nlink : 1);
    fts_close(tree);
    return sum;
}
