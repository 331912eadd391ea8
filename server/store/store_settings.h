/* The database that the settings name: a file in the data folder, or a server's. */
#ifndef SELVEDGE_SERVER_STORE_SETTINGS_H
#define SELVEDGE_SERVER_STORE_SETTINGS_H

#include "server/settings/settings.h"
#include "server/store/store.h"

/* The caller calls store_place_release. STATUS_INVALID: the address is not one of PostgreSQL, or other users may read
 * the file with its password; STATUS_IO. */
status store_settings_place(const struct settings *s, struct store_place *place, struct error *err);
/* Whether a server has the database, which other daemons may use too. */
bool store_settings_shared(const struct settings *s);
/* STATUS_UNSUPPORTED, with the command to use instead, for a command that works on the file of an embedded database. */
status store_settings_need_file(const struct settings *s, const char *command, const char *instead, struct error *err);
/* Opens the database; beside: without a migration, while a daemon uses it. */
status store_settings_open(const struct settings *s, bool beside, struct store **store, struct error *err);

#endif
