#include "server/main/first_token.h"
#include "server/store/store_settings.h"

#include <stdio.h>
#include <string.h>

status first_token_make(const struct settings *settings, bool running, const char *name, enum access_scope scope,
                        char text[ACCESS_SECRET_TEXT_BYTES], struct error *err)
{
    struct store *store = NULL;
    struct token_row row = {.scope = scope, .quota = {QUOTA_DEFAULT, QUOTA_DEFAULT, QUOTA_DEFAULT}};
    if (strlen(name) >= sizeof row.name)
        return error_set_field(err, STATUS_INVALID, "name", "the name has more than %zu characters",
                               sizeof row.name - 1);
    snprintf(row.name, sizeof row.name, "%s", name);
    status s = store_settings_open(settings, running, &store, err);
    if (s == STATUS_OK) s = access_token_make(store, &row, text, err);
    store_close(store);
    return s;
}
