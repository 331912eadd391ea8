#include "server/settings/secret_file.h"
#include "base/files/durable.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static bool is_credential(const char *path)
{
    const char *folder = getenv("CREDENTIALS_DIRECTORY");
    size_t n = folder != NULL ? strlen(folder) : 0;
    return n > 0 && strncmp(path, folder, n) == 0 && path[n] == '/' && strstr(path + n, "/../") == NULL;
}

status secret_file_read(const char *path, const char *setting, size_t most, char **text, size_t *n, struct error *err)
{
    struct stat st;
    if (stat(path, &st) == 0 && (st.st_mode & (S_IRWXG | S_IRWXO)) != 0 && !is_credential(path))
        return error_set_field(err, STATUS_INVALID, setting,
                               "other users may read '%s'; forbid it with: chmod 600 '%s'", path, path);
    return file_read_all(path, most, text, n, err);
}
