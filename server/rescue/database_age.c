#include "server/rescue/database_age.h"
#include "server/settings/job_paths.h"
#include "server/store/drivers/store_backup.h"
#include "server/store/job_journal.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* A folder of a job, and how it compares with the database. */
struct compared {
    char id[STORE_ID_BYTES];
    double sealed_unix_s; /* of its journal; 0: it has no sealed record */
    bool known, older;    /* by the database; its row is older than the journal */
};

struct comparison {
    struct compared *folder;
    size_t n;
    double allowed_s; /* by which a row may be older: clocks of daemons that share a database differ */
};

enum { SHARED_ALLOWED_S = 300 };

static int by_id(const void *a, const void *b)
{
    const struct compared *x = a, *y = b;
    return strcmp(x->id, y->id);
}

static void folder_of(const struct settings *s, const char *id, char out[PATH_BYTES])
{
    path_join(out, s->data, "jobs", id, NULL);
}

/* Lists the folders with the times of their journals, in the order of their ids. */
static status list(const struct settings *s, struct comparison *c, struct error *err)
{
    char path[PATH_BYTES];
    struct journal_key key;
    status r = journal_key_read(s->data, false, &key, err);
    path_join(path, s->data, "jobs", NULL);
    DIR *d = r == STATUS_OK ? opendir(path) : NULL;
    for (struct dirent *e; d != NULL && r == STATUS_OK && (e = readdir(d)) != NULL;) {
        if (!id_valid(e->d_name)) continue;
        struct compared *more =
            (c->n & (c->n - 1)) != 0 ? c->folder : realloc(c->folder, (c->n == 0 ? 1 : 2 * c->n) * sizeof *more);
        if (more == NULL) {
            r = error_set(err, STATUS_NO_MEMORY, "cannot compare the database with the folders: out of memory");
            break;
        }
        c->folder = more;
        more[c->n] = (struct compared){0};
        memcpy(more[c->n].id, e->d_name, 37);
        folder_of(s, e->d_name, path);
        more[c->n].sealed_unix_s = job_journal_sealed_unix_s(&key, path, e->d_name);
        c->n++;
    }
    if (d != NULL) closedir(d);
    if (c->n > 0) qsort(c->folder, c->n, sizeof *c->folder, by_id);
    return r;
}

static void visit_row(void *context, const char *id, double updated_unix_s)
{
    struct comparison *c = context;
    struct compared wanted = {0};
    snprintf(wanted.id, sizeof wanted.id, "%s", id);
    struct compared *found = c->n == 0 ? NULL : bsearch(&wanted, c->folder, c->n, sizeof *c->folder, by_id);
    if (found == NULL) return;
    found->known = true;
    found->older = updated_unix_s < found->sealed_unix_s - c->allowed_s;
}

/* Whether a folder that the database does not know is the folder of a job that was acknowledged and not deleted. A
 * folder whose job was deleted meanwhile is gone. */
static bool is_missing(const char *folder, const char *id)
{
    struct job_journal journal = {0};
    struct stat st;
    bool missing = job_journal_read(folder, &journal, NULL) == STATUS_OK && journal.has_job && !journal.job.deleted &&
                   strcmp(journal.job.id, id) == 0 && lstat(folder, &st) == 0;
    job_journal_release(&journal);
    return missing;
}

status database_age_check(const struct settings *s, const char *database, struct store *store, struct error *err)
{
    struct comparison c = {.allowed_s = store == NULL ? 0 : SHARED_ALLOWED_S};
    size_t n_missing = 0, n_older = 0;
    const char *first = "";
    char path[PATH_BYTES];
    /* the journals before the database, because a daemon may write meanwhile */
    status r = list(s, &c, err);
    if (r == STATUS_OK && (store == NULL ? store_read_ages(database, visit_row, &c)
                                         : store_job_ages(store, visit_row, &c, NULL)) != STATUS_OK)
        c.n = 0;
    for (size_t i = 0; r == STATUS_OK && i < c.n; i++) {
        folder_of(s, c.folder[i].id, path);
        bool missing = !c.folder[i].known && is_missing(path, c.folder[i].id);
        n_missing += missing;
        n_older += c.folder[i].older;
        if (first[0] == '\0' && (missing || c.folder[i].older)) first = c.folder[i].id;
    }
    if (n_missing + n_older > 0)
        r = error_set(err, STATUS_FORMAT,
                      "database '%s' is behind the folders of the jobs: it lacks %zu jobs that were acknowledged and "
                      "has an older state of %zu (the first is %s)",
                      database, n_missing, n_older, first);
    free(c.folder);
    return r;
}
