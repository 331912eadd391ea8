/* Secrets that stand for a user: access tokens, "selvedge_" and 256 random bits in base64url, and sessions of browsers.
 * The database keeps their BLAKE2b hashes only; a hash without salt or stretching suffices for secrets that cannot be
 * guessed. */
#ifndef SELVEDGE_SERVER_ACCESS_SECRET_H
#define SELVEDGE_SERVER_ACCESS_SECRET_H

#include "server/store/store_access.h"

enum { ACCESS_SECRET_TEXT_BYTES = 64 };

/* Makes a secret and its hash. */
void access_secret_new(char text[ACCESS_SECRET_TEXT_BYTES], unsigned char hash[STORE_SECRET_HASH_BYTES]);
void access_secret_hash(const char *text, unsigned char hash[STORE_SECRET_HASH_BYTES]);

/* Makes a token from row->name, owner ("": the name), scope and quota, stores it, and gives its text, which nothing can
 * give again. STATUS_INVALID (name, owner), STATUS_EXISTS. */
status access_token_make(struct store *store, struct token_row *row, char text[ACCESS_SECRET_TEXT_BYTES],
                         struct error *err);

#endif
