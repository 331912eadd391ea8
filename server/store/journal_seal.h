/* Seals of the records of journals. A worker may write into its job's folder, so only a sealed record in a journal is
 * certain to be a change that the daemon has acknowledged: it ends in a checksum (HMAC) with a key that no worker can
 * read, the file journal.key of the data folder. */
#ifndef SELVEDGE_SERVER_JOURNAL_SEAL_H
#define SELVEDGE_SERVER_JOURNAL_SEAL_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { JOURNAL_KEY_LENGTH = 32 };

struct journal_key {
    bool known; /* false: nothing is sealed, and no seal is right */
    unsigned char bytes[JOURNAL_KEY_LENGTH];
};

/* Reads the key of a data folder. make: makes one where there is none, or a damaged one; otherwise the key is then not
 * known. STATUS_IO, STATUS_DISK_FULL. */
status journal_key_read(const char *data, bool make, struct journal_key *key, struct error *err);
/* Returns the text of a JSON object with a seal as its last member; the caller frees it. NULL: out of memory. */
char *journal_seal(const struct journal_key *key, const char *object);
/* Returns true if the n bytes are a text that journal_seal has returned with this key. */
bool journal_sealed(const struct journal_key *key, const char *text, size_t n);

#endif
