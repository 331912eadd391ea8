/* Databases for tests of the store: an empty one of each kind that this machine has. PostgreSQL is a server that is
 * started for the test program (tests/support/python/servers/postgres_server.py) and ends with it. */
#ifndef SELVEDGE_TESTS_STORE_FIXTURE_H
#define SELVEDGE_TESTS_STORE_FIXTURE_H

#include "server/store/store.h"

struct store_fixture {
    char folder[64];
    struct store_place place;
    struct store *store;
};

/* Runs the tests of a program over each kind of database, whose name is that of the group of tests; without PostgreSQL
 * it prints why, and that group has one test that is skipped (that fails, where PostgreSQL is installed and does not
 * start). Returns the number of failures. */
int store_fixture_each(int (*run)(const char *database));
/* The same with PostgreSQL alone. */
int store_fixture_shared(int (*run)(const char *database));

/* Makes and opens an empty database of the present kind. Returns 0, or -1 after an error that it prints. */
int store_fixture_begin(struct store_fixture *f);
void store_fixture_reopen(struct store_fixture *f);
void store_fixture_end(struct store_fixture *f);

#endif
