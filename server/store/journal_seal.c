#include "server/store/journal_seal.h"
#include "base/files/durable.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SEAL_MEMBER ",\"seal\":\""
enum { SEAL_HEX = 2 * crypto_auth_BYTES, SEAL_BYTES = sizeof SEAL_MEMBER - 1 + SEAL_HEX + 2, PATH_LIMIT_BYTES = 4096 };

_Static_assert(JOURNAL_KEY_LENGTH == crypto_auth_KEYBYTES, "the key fits the checksum");

status journal_key_read(const char *data, bool make, struct journal_key *key, struct error *err)
{
    char path[PATH_LIMIT_BYTES], *found = NULL;
    size_t n = 0;
    *key = (struct journal_key){0};
    if (snprintf(path, sizeof path, "%s/journal.key", data) >= (int)sizeof path)
        return error_set(err, STATUS_INVALID, "path '%.200s' is too long", data);
    status s = file_read_all(path, JOURNAL_KEY_LENGTH, &found, &n, NULL);
    key->known = s == STATUS_OK && n == JOURNAL_KEY_LENGTH;
    if (key->known) memcpy(key->bytes, found, JOURNAL_KEY_LENGTH);
    free(found);
    if (key->known || !make) return STATUS_OK;
    randombytes_buf(key->bytes, sizeof key->bytes);
    s = durable_replace(path, key->bytes, sizeof key->bytes, err);
    key->known = s == STATUS_OK;
    return s;
}

static void seal_of(const struct journal_key *key, const char *text, size_t n, char hex[SEAL_HEX + 1])
{
    unsigned char sum[crypto_auth_BYTES];
    crypto_auth(sum, (const unsigned char *)text, n, key->bytes);
    sodium_bin2hex(hex, SEAL_HEX + 1, sum, sizeof sum);
}

char *journal_seal(const struct journal_key *key, const char *object)
{
    char hex[SEAL_HEX + 1];
    size_t n = strlen(object);
    if (!key->known || n < 3) return strdup(object);
    char *out = malloc(n + SEAL_BYTES + 1);
    if (out == NULL) return NULL;
    seal_of(key, object, n - 1, hex);
    snprintf(out, n + SEAL_BYTES + 1, "%.*s" SEAL_MEMBER "%s\"}", (int)(n - 1), object, hex);
    return out;
}

bool journal_sealed(const struct journal_key *key, const char *text, size_t n)
{
    char hex[SEAL_HEX + 1], end[SEAL_BYTES + 1];
    if (!key->known || n <= SEAL_BYTES) return false;
    seal_of(key, text, n - SEAL_BYTES, hex);
    snprintf(end, sizeof end, SEAL_MEMBER "%s\"}", hex);
    return sodium_memcmp(end, text + n - SEAL_BYTES, SEAL_BYTES) == 0;
}
