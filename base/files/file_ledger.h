/* The ledger of a file: everything that a foreign file states beside its samples, with the use that was made of it.
 *
 * A reader adds one entry for each statement. Code that knows the document settles the entries: a statement is applied,
 * or not used for a stated reason. A statement that the document contradicts is no entry but an error, which names
 * both. Names are the field's words: "voxel size", "channels", "orientation", "exposure time". A ledger is a plain
 * value; it owns nothing. */
#ifndef SELVEDGE_BASE_FILE_LEDGER_H
#define SELVEDGE_BASE_FILE_LEDGER_H

#include <stdbool.h>
#include <stddef.h>

enum { FILE_LEDGER_MAX = 24, FILE_STATEMENT_BYTES = 96 };

enum file_statement_use { FILE_STATEMENT_APPLIED, FILE_STATEMENT_NOT_USED };

struct file_statement {
    char name[32];
    char value[FILE_STATEMENT_BYTES];  /* as a person reads it, with its unit: "2 x 2 x 2.5 um" */
    char reason[FILE_STATEMENT_BYTES]; /* why it is not used; "" where it is applied */
    enum file_statement_use use;
};

struct file_ledger {
    size_t n;
    struct file_statement item[FILE_LEDGER_MAX];
};

/* Adds a statement, or replaces the one of the same name. reason: NULL or "" for a statement that is applied. Control
 * characters of the value become blanks, and a long value is cut. A full ledger ends in "further statements", which
 * counts the rest. ledger may be NULL. */
void file_ledger_add(struct file_ledger *ledger, const char *name, const char *reason, const char *value, ...)
    __attribute__((format(printf, 4, 5)));
/* Changes the use of the statement `name`, if the ledger has it: reason as above. */
void file_ledger_settle(struct file_ledger *ledger, const char *name, const char *reason);
/* Returns the statement `name`, NULL where the ledger has none. */
const struct file_statement *file_ledger_find(const struct file_ledger *ledger, const char *name);
/* Returns "applied" or "not_used". */
const char *file_statement_use_name(enum file_statement_use use);

#endif
