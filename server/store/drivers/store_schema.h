/* The tables of the database, as lists of changes from one version of the schema to the next. */
#ifndef SELVEDGE_SERVER_STORE_SCHEMA_H
#define SELVEDGE_SERVER_STORE_SCHEMA_H

/* Returns the n statements: entry i changes the schema of SQLite from version i to version i + 1. */
const char *const *store_migrations(int *n);
/* The same of PostgreSQL: lists of scripts, which NULL ends. */
const char *const *const *store_postgres_migrations(int *n);

#endif
