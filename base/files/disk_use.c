#include "base/files/disk_use.h"

#include <fts.h>
#include <stddef.h>
#include <sys/stat.h>

enum { BLOCK_BYTES = 512 };

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
