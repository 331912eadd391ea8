#include "server/main/rescue_commands.h"
#include "server/doctor/doctor.h"
#include "server/rescue/quarantine.h"
#include "server/rescue/rebuild.h"
#include "server/settings/job_paths.h"
#include "server/store/drivers/store_backup.h"
#include "server/store/store_settings.h"

#include <string.h>

status rescue_check(const struct rescue_request *q, struct error *err)
{
    bool restore = q->command == RESCUE_QUARANTINE && strcmp(q->word, "restore") == 0;
    if (q->command == RESCUE_QUARANTINE && !restore && strcmp(q->word, "list") != 0)
        return error_set(err, STATUS_INVALID, "--quarantine needs 'list' or 'restore', not '%.100s'", q->word);
    if (restore && q->operand == NULL)
        return error_set(err, STATUS_INVALID, "--quarantine restore needs the id of a job");
    if (!restore && q->command != RESCUE_DOCTOR && q->operand != NULL)
        return error_set(err, STATUS_INVALID, "unexpected argument '%.200s'", q->operand);
    if (q->resume && q->command != RESCUE_REBUILD)
        return error_set(err, STATUS_INVALID, "--resume belongs to --rebuild");
    return STATUS_OK;
}

bool rescue_needs_lock(const struct rescue_request *q)
{
    return q->command == RESCUE_REBUILD || (q->command == RESCUE_QUARANTINE && q->operand != NULL);
}

static status back_up(const struct settings *settings, const char *to, FILE *out, struct error *err)
{
    char path[PATH_BYTES];
    struct store_summary found;
    status s = store_settings_need_file(settings, "--backup", "copy the database with pg_dump", err);
    if (s != STATUS_OK) return s;
    path_join(path, settings->data, "selvedge.db", NULL);
    s = store_backup(path, to, &found, err);
    if (s == STATUS_OK)
        fprintf(out, "'%s': %lld jobs, %lld files, %lld bytes\n", to, (long long)found.n_job, (long long)found.n_file,
                (long long)found.n_bytes);
    return s;
}

status rescue_run(const struct settings *settings, const struct rescue_request *q, FILE *out, struct error *err)
{
    switch (q->command) {
    case RESCUE_BACKUP:
        return back_up(settings, q->word, out, err);
    case RESCUE_REBUILD:
        return rebuild(settings, q->resume, out, err);
    case RESCUE_QUARANTINE:
        return q->operand == NULL ? quarantine_list(settings, out, err)
                                  : quarantine_restore(settings, q->operand, out, err);
    case RESCUE_DOCTOR:
        return doctor_run(settings, q->worker, q->operand, out, err);
    case RESCUE_NONE:
        break;
    }
    return STATUS_OK;
}
