#include "base/files/file_ledger.h"
#include "base/utf8.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char overflow[] = "further statements";

/* Returns the place of the statement, ledger->n where there is none. */
static size_t find(const struct file_ledger *ledger, const char *name)
{
    size_t i = 0;
    while (i < ledger->n && strcmp(ledger->item[i].name, name) != 0) i++;
    return i;
}

static void set_reason(struct file_statement *f, const char *reason)
{
    f->use = reason == NULL || reason[0] == '\0' ? FILE_STATEMENT_APPLIED : FILE_STATEMENT_NOT_USED;
    snprintf(f->reason, sizeof f->reason, "%s", f->use == FILE_STATEMENT_APPLIED ? "" : reason);
}

/* Values come from foreign files and go to terminals, pages and JSON. */
static void clean(char *text)
{
    utf8_repair(text);
    for (unsigned char *c = (unsigned char *)text; *c != '\0'; c++)
        if (*c < 0x20 || *c == 0x7f) *c = ' ';
}

/* A full ledger keeps its last place for the number of statements that did not fit. */
static struct file_statement *reserve(struct file_ledger *ledger, const char *name)
{
    size_t i = find(ledger, name);
    if (i < ledger->n) return &ledger->item[i];
    if (ledger->n < FILE_LEDGER_MAX - 1) return &ledger->item[ledger->n++];
    struct file_statement *f = &ledger->item[FILE_LEDGER_MAX - 1];
    unsigned long more = ledger->n < FILE_LEDGER_MAX ? 0 : strtoul(f->value, NULL, 10);
    ledger->n = FILE_LEDGER_MAX;
    snprintf(f->name, sizeof f->name, "%s", overflow);
    snprintf(f->value, sizeof f->value, "%lu", more + 1);
    set_reason(f, "there is no room to list them");
    return NULL;
}

void file_ledger_add(struct file_ledger *ledger, const char *name, const char *reason, const char *value, ...)
{
    if (ledger == NULL) return;
    struct file_statement *f = reserve(ledger, name);
    if (f == NULL) return;
    va_list argument;
    va_start(argument, value);
    vsnprintf(f->value, sizeof f->value, value, argument);
    va_end(argument);
    snprintf(f->name, sizeof f->name, "%s", name);
    set_reason(f, reason);
    clean(f->value);
}

void file_ledger_settle(struct file_ledger *ledger, const char *name, const char *reason)
{
    if (ledger == NULL) return;
    size_t i = find(ledger, name);
    if (i < ledger->n) set_reason(&ledger->item[i], reason);
}

const struct file_statement *file_ledger_find(const struct file_ledger *ledger, const char *name)
{
    size_t i = find(ledger, name);
    return i < ledger->n ? &ledger->item[i] : NULL;
}

const char *file_statement_use_name(enum file_statement_use use)
{
    return use == FILE_STATEMENT_APPLIED ? "applied" : "not_used";
}
