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
    /* access tokens and sessions; the owner of each job, with an index for each order in which an owner's jobs are
     * listed and one for the order in which they start; what each owner keeps, by triggers. Keys of idempotency are per
     * owner */
    "CREATE TABLE access_token (serial INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, name TEXT NOT NULL,"
    " owner TEXT NOT NULL, scope INTEGER NOT NULL, hash BLOB NOT NULL UNIQUE, created REAL NOT NULL, used REAL NOT "
    "NULL,"
    " revoked REAL NOT NULL, requests INTEGER NOT NULL, bytes INTEGER NOT NULL, jobs INTEGER NOT NULL);"
    "CREATE UNIQUE INDEX access_token_name ON access_token (name) WHERE revoked = 0;"
    "CREATE TABLE session (hash BLOB PRIMARY KEY, token_id TEXT NOT NULL, expires REAL NOT NULL) WITHOUT ROWID;"
    "ALTER TABLE job ADD COLUMN owner TEXT NOT NULL DEFAULT '';"
    "ALTER TABLE job ADD COLUMN priority INTEGER NOT NULL DEFAULT 0;"
    "CREATE INDEX job_owner ON job (deleted, owner, serial);"
    "CREATE INDEX job_owner_state ON job (deleted, state, owner, serial);"
    "DROP INDEX job_queue;"
    "CREATE INDEX job_turn ON job (owner, priority DESC, queued, serial) WHERE deleted = 0 AND state = 1;"
    "CREATE TABLE owner_use (owner TEXT PRIMARY KEY, jobs INTEGER NOT NULL, queued INTEGER NOT NULL,"
    " bytes INTEGER NOT NULL);"
    "INSERT INTO owner_use SELECT '', count(*), ifnull(sum(state = 1), 0), (SELECT ifnull(sum(f.size), 0) FROM file f"
    " JOIN job j ON j.id = f.job_id WHERE j.deleted = 0) FROM job WHERE deleted = 0;"
    "CREATE TRIGGER use_job_added AFTER INSERT ON job WHEN NEW.deleted = 0 BEGIN"
    " INSERT INTO owner_use VALUES (NEW.owner, 1, NEW.state = 1, 0) ON CONFLICT (owner) DO UPDATE SET jobs = jobs + 1,"
    " queued = queued + excluded.queued; END;"
    "CREATE TRIGGER use_job_changed AFTER UPDATE OF state, deleted ON job"
    " WHEN NEW.state <> OLD.state OR NEW.deleted <> OLD.deleted BEGIN"
    " UPDATE owner_use SET jobs = jobs + (NEW.deleted = 0) - (OLD.deleted = 0), queued = queued"
    " + (NEW.deleted = 0 AND NEW.state = 1) - (OLD.deleted = 0 AND OLD.state = 1) WHERE owner = NEW.owner; END;"
    "CREATE TRIGGER use_job_hidden AFTER UPDATE OF deleted ON job WHEN NEW.deleted <> OLD.deleted BEGIN"
    " UPDATE owner_use SET bytes = bytes + (OLD.deleted - NEW.deleted) * (SELECT ifnull(sum(size), 0) FROM file"
    " WHERE job_id = NEW.id) WHERE owner = NEW.owner; END;"
    "CREATE TRIGGER use_job_removed AFTER DELETE ON job WHEN OLD.deleted = 0 BEGIN"
    " UPDATE owner_use SET jobs = jobs - 1, queued = queued - (OLD.state = 1) WHERE owner = OLD.owner; END;"
    "CREATE TRIGGER use_file_added AFTER INSERT ON file BEGIN UPDATE owner_use SET bytes = bytes + NEW.size"
    " WHERE owner = (SELECT owner FROM job WHERE id = NEW.job_id AND deleted = 0); END;"
    "CREATE TRIGGER use_file_removed AFTER DELETE ON file BEGIN UPDATE owner_use SET bytes = bytes - OLD.size"
    " WHERE owner = (SELECT owner FROM job WHERE id = OLD.job_id AND deleted = 0); END;"
    "ALTER TABLE idempotency RENAME TO idempotency_before;"
    "CREATE TABLE idempotency (owner TEXT NOT NULL, key TEXT NOT NULL, job_id TEXT NOT NULL, body_hash TEXT NOT NULL,"
    " created REAL NOT NULL, PRIMARY KEY (owner, key));"
    "INSERT INTO idempotency SELECT '', key, job_id, body_hash, created FROM idempotency_before;"
    "DROP TABLE idempotency_before;"
    "CREATE INDEX idempotency_job ON idempotency (job_id);"
    "ALTER TABLE delivery ADD COLUMN owner TEXT NOT NULL DEFAULT '';"
    "CREATE INDEX delivery_owner ON delivery (owner, serial);"
    "DROP TRIGGER job_ended;"
    "CREATE TRIGGER job_ended AFTER UPDATE OF state ON job WHEN NEW.state <> OLD.state AND NEW.state IN (4, 5, 6)"
    " AND NEW.deleted = 0 AND EXISTS (SELECT 1 FROM webhook) BEGIN"
    " INSERT INTO delivery (id, job_id, job_state, sample, attempt, error_code, error_field, error_text, created, "
    "state,"
    " tries, next, status, error, delivered, owner) VALUES (NEW.id || '.' || NEW.revision, NEW.id, NEW.state,"
    " NEW.sample, NEW.attempt, NEW.error_code, NEW.error_field, NEW.error_text, NEW.updated, 0, 0, NEW.updated, 0, '',"
    " 0, NEW.owner); END;",
    /* tags ("" or " a b "), and the code of the verdict, "?" until it has been read from the result; indexes for the
     * orders of the list and for finding an input by its content */
    "ALTER TABLE job ADD COLUMN tags TEXT NOT NULL DEFAULT '';"
    "ALTER TABLE job ADD COLUMN verdict TEXT NOT NULL DEFAULT '';"
    "UPDATE job SET verdict = '?' WHERE state = 4;"
    "CREATE INDEX job_finished ON job (deleted, finished, serial);"
    "CREATE INDEX job_sample ON job (deleted, sample COLLATE NOCASE, serial);"
    "CREATE INDEX file_content ON file (sha256, size) WHERE state = 2 AND sha256 <> '';",
    /* bytes of the earlier results that a job keeps, which count as its owner's beside the input files */
    "ALTER TABLE job ADD COLUMN version_bytes INTEGER NOT NULL DEFAULT 0;"
    "CREATE TRIGGER use_version_changed AFTER UPDATE OF version_bytes ON job WHEN NEW.deleted = 0 BEGIN"
    " UPDATE owner_use SET bytes = bytes + NEW.version_bytes - OLD.version_bytes WHERE owner = NEW.owner; END;"
    "DROP TRIGGER IF EXISTS use_job_hidden;"
    "CREATE TRIGGER use_job_hidden AFTER UPDATE OF deleted ON job WHEN NEW.deleted <> OLD.deleted BEGIN"
    " UPDATE owner_use SET bytes = bytes + (OLD.deleted - NEW.deleted) * (NEW.version_bytes"
    " + (SELECT ifnull(sum(size), 0) FROM file WHERE job_id = NEW.id)) WHERE owner = NEW.owner; END;"
    "DROP TRIGGER IF EXISTS use_job_removed;"
    "CREATE TRIGGER use_job_removed AFTER DELETE ON job WHEN OLD.deleted = 0 BEGIN"
    " UPDATE owner_use SET jobs = jobs - 1, queued = queued - (OLD.state = 1), bytes = bytes - OLD.version_bytes"
    " WHERE owner = OLD.owner; END;",
};

const char *const *store_migrations(int *n)
{
    *n = (int)(sizeof migration / sizeof migration[0]);
    return migration;
}
