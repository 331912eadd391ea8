/* `selvedged --make-token NAME`: makes a token without the daemon's help, so that the first one can be made, and one
 * for an administrator who has lost theirs. Whoever may write the data folder may do so. */
#ifndef SELVEDGE_SERVER_FIRST_TOKEN_H
#define SELVEDGE_SERVER_FIRST_TOKEN_H

#include "server/access/access_secret.h"
#include "server/settings/settings.h"

/* Makes a token with the default quotas. running: a daemon uses the data folder meanwhile; it asks for tokens from its
 * next request on. STATUS_CONFLICT when that daemon's database is of another version; else as access_token_make and
 * store_open. */
status first_token_make(const struct settings *settings, bool running, const char *name, enum access_scope scope,
                        char text[ACCESS_SECRET_TEXT_BYTES], struct error *err);

#endif
