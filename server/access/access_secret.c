#include "server/access/access_secret.h"
#include "base/clock.h"

#include <sodium.h>
#include <stdio.h>
#include <string.h>
#include <uuid/uuid.h>

enum { SECRET_BYTES = 32 };
static const char prefix[] = "selvedge_";

void access_secret_hash(const char *text, unsigned char hash[STORE_SECRET_HASH_BYTES])
{
    crypto_generichash(hash, STORE_SECRET_HASH_BYTES, (const unsigned char *)text, strlen(text), NULL, 0);
}

void access_secret_new(char text[ACCESS_SECRET_TEXT_BYTES], unsigned char hash[STORE_SECRET_HASH_BYTES])
{
    unsigned char random[SECRET_BYTES];
    randombytes_buf(random, sizeof random);
    memcpy(text, prefix, sizeof prefix);
    sodium_bin2base64(text + sizeof prefix - 1, ACCESS_SECRET_TEXT_BYTES - sizeof prefix + 1, random, sizeof random,
                      sodium_base64_VARIANT_URLSAFE_NO_PADDING);
    sodium_memzero(random, sizeof random);
    access_secret_hash(text, hash);
}

static status check_name(const char *field, const char *name, struct error *err)
{
    size_t n = strlen(name);
    bool good = n > 0 && n < STORE_OWNER_BYTES;
    for (size_t i = 0; good && i < n; i++)
        good = (name[i] >= 'a' && name[i] <= 'z') || (name[i] >= 'A' && name[i] <= 'Z') ||
               (name[i] >= '0' && name[i] <= '9') || strchr("._@-", name[i]) != NULL;
    if (good) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, field,
                           "%s '%.80s' is not 1 to %d of the characters A-Z a-z 0-9 . _ @ -", field, name,
                           STORE_OWNER_BYTES - 1);
}

status access_token_make(struct store *store, struct token_row *row, char text[ACCESS_SECRET_TEXT_BYTES],
                         struct error *err)
{
    uuid_t u;
    if (row->owner[0] == '\0') memcpy(row->owner, row->name, sizeof row->owner);
    status s = check_name("name", row->name, err);
    if (s == STATUS_OK) s = check_name("owner", row->owner, err);
    if (s != STATUS_OK) return s;
    uuid_generate_random(u);
    uuid_unparse_lower(u, row->id);
    row->created_unix_s = clock_wall_s();
    access_secret_new(text, row->hash);
    return store_token_insert(store, row, err);
}
