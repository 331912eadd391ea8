/* The schema of the database, and how an older one becomes the present one. */
#include "server/store/store_sql.h"

/* Entry i changes the schema from version i to version i + 1. */
static const char *const migration[] = {
    "CREATE TABLE job (serial INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, sample TEXT NOT NULL, "
    "document TEXT NOT NULL,"
    " state INTEGER NOT NULL, cancel_requested INTEGER NOT NULL, dirty INTEGER NOT NULL, deleted INTEGER NOT NULL,"
    " attempt INTEGER NOT NULL, lost_attempts INTEGER NOT NULL, generation INTEGER NOT NULL, token TEXT NOT NULL,"
    " created REAL NOT NULL, updated REAL NOT NULL, queued REAL NOT NULL, started REAL NOT NULL, finished REAL NOT "
    "NULL,"
    " error_code TEXT NOT NULL, error_field TEXT NOT NULL, error_text TEXT NOT NULL, peak_rss INTEGER NOT NULL);"
    "CREATE INDEX job_state ON job (deleted, state, serial);"
    "CREATE TABLE file (serial INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, job_id TEXT NOT NULL, name "
    "TEXT NOT NULL,"
    " role TEXT NOT NULL, size INTEGER NOT NULL, offset INTEGER NOT NULL, sha256 TEXT NOT NULL, state INTEGER NOT "
    "NULL, hash_state BLOB NOT NULL,"
    " UNIQUE (job_id, name));"
    "CREATE TABLE idempotency (key TEXT PRIMARY KEY, job_id TEXT NOT NULL, body_hash TEXT NOT NULL, created REAL NOT "
    "NULL);"
    "CREATE INDEX idempotency_job ON idempotency (job_id);"
    "CREATE TABLE probe (one INTEGER PRIMARY KEY, at REAL NOT NULL);",
    /* documents apart, so that reading and writing a job costs the same whatever its document; an index for each order
     * in which jobs are listed; counts and revisions, which triggers keep */
    "CREATE TABLE document (job_id TEXT PRIMARY KEY, text TEXT NOT NULL);"
    "INSERT INTO document SELECT id, document FROM job;"
    "ALTER TABLE job DROP COLUMN document;"
    "ALTER TABLE job ADD COLUMN revision INTEGER NOT NULL DEFAULT 0;"
    "CREATE INDEX job_newest ON job (deleted, serial);"
    "CREATE INDEX job_queue ON job (deleted, state, queued, serial);"
    "CREATE TABLE job_count (state INTEGER PRIMARY KEY, n INTEGER NOT NULL);"
    "INSERT INTO job_count SELECT state, count(*) FROM job WHERE deleted = 0 GROUP BY state;"
    "CREATE TRIGGER job_added AFTER INSERT ON job WHEN NEW.deleted = 0 BEGIN"
    " INSERT INTO job_count VALUES (NEW.state, 1) ON CONFLICT (state) DO UPDATE SET n = n + 1; END;"
    "CREATE TRIGGER job_changed AFTER UPDATE OF state, deleted ON job BEGIN"
    " UPDATE job_count SET n = n - 1 WHERE state = OLD.state AND OLD.deleted = 0;"
    " INSERT INTO job_count SELECT NEW.state, 1 WHERE NEW.deleted = 0 ON CONFLICT (state) DO UPDATE SET n = n + 1; END;"
    "CREATE TRIGGER job_removed AFTER DELETE ON job WHEN OLD.deleted = 0 BEGIN"
    " UPDATE job_count SET n = n - 1 WHERE state = OLD.state; END;"
    "CREATE TRIGGER file_added AFTER INSERT ON file BEGIN"
    " UPDATE job SET revision = revision + 1 WHERE id = NEW.job_id; END;"
    "CREATE TRIGGER file_changed AFTER UPDATE ON file BEGIN"
    " UPDATE job SET revision = revision + 1 WHERE id = NEW.job_id; END;"
    "CREATE TRIGGER file_removed AFTER DELETE ON file BEGIN"
    " UPDATE job SET revision = revision + 1 WHERE id = OLD.job_id; END;",
    /* deliveries of webhooks, which a trigger adds in the transaction that ends a job while the table webhook has a
     * row. The revision of a job rises with each change, so it makes the id unique */
    "CREATE TABLE webhook (one INTEGER PRIMARY KEY);"
    "CREATE TABLE delivery (serial INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, job_id TEXT NOT NULL,"
    " job_state INTEGER NOT NULL, sample TEXT NOT NULL, attempt INTEGER NOT NULL, error_code TEXT NOT NULL,"
    " error_field TEXT NOT NULL, error_text TEXT NOT NULL, created REAL NOT NULL, state INTEGER NOT NULL,"
    " tries INTEGER NOT NULL, next REAL NOT NULL, status INTEGER NOT NULL, error TEXT NOT NULL,"
    " delivered REAL NOT NULL);"
    "CREATE INDEX delivery_waiting ON delivery (state, next, serial);"
    "CREATE INDEX delivery_job ON delivery (job_id, serial);"
    "CREATE TRIGGER job_ended AFTER UPDATE OF state ON job WHEN NEW.state <> OLD.state AND NEW.state IN (4, 5, 6)"
    " AND NEW.deleted = 0 AND EXISTS (SELECT 1 FROM webhook) BEGIN"
    " INSERT INTO delivery (id, job_id, job_state, sample, attempt, error_code, error_field, error_text, created, "
    "state,"
    " tries, next, status, error, delivered) VALUES (NEW.id || '.' || NEW.revision, NEW.id, NEW.state, NEW.sample,"
    " NEW.attempt, NEW.error_code, NEW.error_field, NEW.error_text, NEW.updated, 0, 0, NEW.updated, 0, '', 0); END;",
};

const char *const *store_migrations(int *n)
{
    *n = (int)(sizeof migration / sizeof migration[0]);
    return migration;
}
