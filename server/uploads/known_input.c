#include "server/uploads/known_input.h"
#include "server/settings/job_paths.h"
#include "server/uploads/upload_file.h"

#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool known_input_exists(struct store *store, const char *owner, const struct file_row *row)
{
    struct file_row source;
    return row->sha256[0] != '\0' &&
           store_file_known(store, owner, row->sha256, row->size_bytes, &source, NULL) == STATUS_OK;
}

bool known_input_link(struct store *store, const char *data, const char *owner, struct file_row *row)
{
    struct file_row source;
    struct stat st;
    char from[PATH_BYTES], to[PATH_BYTES];
    if (row->sha256[0] == '\0' ||
        store_file_known(store, owner, row->sha256, row->size_bytes, &source, NULL) != STATUS_OK)
        return false;
    upload_input_path(data, &source, from);
    upload_input_path(data, row, to);
    if (lstat(from, &st) != 0 || !S_ISREG(st.st_mode) || (int64_t)st.st_size != row->size_bytes) return false;
    unlink(to); /* no row has this name: what a daemon that was killed may have left of it */
    if (link(from, to) != 0) return false;
    if (chmod(to, S_IRUSR) != 0) {
        unlink(to);
        return false;
    }
    upload_hash_restart(row);
    row->state = FILE_COMPLETE;
    row->offset_bytes = row->size_bytes;
    return true;
}
