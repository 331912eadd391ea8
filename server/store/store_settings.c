#include "server/store/store_settings.h"
#include "server/settings/job_paths.h"
#include "server/settings/secret_file.h"

#include <stdio.h>
#include <string.h>

enum { PASSWORD_MOST_BYTES = 1024 };

bool store_settings_shared(const struct settings *s) { return s->store[0] != '\0'; }

status store_settings_place(const struct settings *s, struct store_place *place, struct error *err)
{
    char path[PATH_BYTES];
    size_t n = 0;
    *place = (struct store_place){0};
    if (!store_settings_shared(s)) {
        path_join(path, s->data, "selvedge.db", NULL);
        snprintf(place->address, sizeof place->address, "%s", path);
        return STATUS_OK;
    }
    /* the address is not quoted, because it may have a password */
    if (strncmp(s->store, "postgresql://", 13) != 0 && strncmp(s->store, "postgres://", 11) != 0)
        return error_set_field(err, STATUS_INVALID, "server.store",
                               "setting 'server.store' must begin with 'postgresql://'");
    snprintf(place->address, sizeof place->address, "%s", s->store);
    if (s->store_password_file[0] == '\0') return STATUS_OK;
    status r = secret_file_read(s->store_password_file, "server.store_password_file", PASSWORD_MOST_BYTES,
                                &place->password, &n, err);
    while (r == STATUS_OK && n > 0 && (place->password[n - 1] == '\n' || place->password[n - 1] == '\r'))
        place->password[--n] = '\0';
    return r == STATUS_OK ? r : error_prefix(err, r, "cannot read the password of the database");
}

status store_settings_need_file(const struct settings *s, const char *command, const char *instead, struct error *err)
{
    if (!store_settings_shared(s)) return STATUS_OK;
    return error_set(err, STATUS_UNSUPPORTED,
                     "%s works on the file of an embedded database, but this service uses PostgreSQL; %s", command,
                     instead);
}

status store_settings_open(const struct settings *s, bool beside, struct store **store, struct error *err)
{
    struct store_place place;
    status r = store_settings_place(s, &place, err);
    if (r == STATUS_OK) r = beside ? store_open_place_beside(&place, store, err) : store_open_place(&place, store, err);
    store_place_release(&place);
    return r;
}
