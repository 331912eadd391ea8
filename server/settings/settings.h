/* The settings of the daemon, from one table with name, kind, default, range and a line of explanation.
 * config/selvedge.conf is that table as `selvedged --print-config` prints it; a test compares the two. */
#ifndef SELVEDGE_SERVER_SETTINGS_H
#define SELVEDGE_SERVER_SETTINGS_H

#include "base/status.h"

#include <stdint.h>
#include <stdio.h>

enum { SETTING_TEXT_BYTES = 512, SETTING_MAX_WORKERS = 1024 };

struct settings {
    /* [server] */
    char listen[SETTING_TEXT_BYTES], data[SETTING_TEXT_BYTES], web[SETTING_TEXT_BYTES], openapi[SETTING_TEXT_BYTES],
        unix_socket[SETTING_TEXT_BYTES], public_origin[SETTING_TEXT_BYTES], tls_certificate[SETTING_TEXT_BYTES],
        tls_key[SETTING_TEXT_BYTES], store[SETTING_TEXT_BYTES], store_password_file[SETTING_TEXT_BYTES];
    int64_t port, max_connections, idle_timeout_s, header_deadline_s, min_rate_bytes_per_s, max_document_bytes,
        max_batch_bytes, body_memory_bytes, lease_s;
    /* [upload] */
    int64_t max_file_bytes, max_patch_bytes, max_files_per_job, commit_bytes;
    /* [jobs] */
    int64_t max_jobs, keep_versions, workers;
    char backend[SETTING_TEXT_BYTES], worker[SETTING_TEXT_BYTES], sandbox[SETTING_TEXT_BYTES],
        pass_environment[SETTING_TEXT_BYTES];
    int64_t threads, ranks, scratch_limit_bytes, file_limit_bytes, folder_depth, thread_limit, open_files,
        oom_score_adj;
    int64_t nice, memory_limit_bytes, resident_limit_bytes, volume_memory_bytes, cancel_grace_s, max_lost_attempts,
        heartbeat_timeout_s, time_limit_s, check_limit_s, plan_queued, pictures;
    /* [slurm] */
    char slurm_commands[SETTING_TEXT_BYTES], slurm_partition[SETTING_TEXT_BYTES], slurm_account[SETTING_TEXT_BYTES],
        slurm_qos[SETTING_TEXT_BYTES], slurm_extra[SETTING_TEXT_BYTES], slurm_mpi[SETTING_TEXT_BYTES];
    int64_t slurm_time_limit_s, slurm_warn_s, slurm_cores, slurm_memory_bytes, slurm_ranks, slurm_poll_s,
        slurm_file_delay_s;
    /* [webhook] */
    char webhook_url[SETTING_TEXT_BYTES], webhook_secret_file[SETTING_TEXT_BYTES];
    int64_t webhook_timeout_s, webhook_retry_s, webhook_max_tries;
    /* [access] */
    char access_required[SETTING_TEXT_BYTES];
    int64_t requests_per_minute, stored_bytes, jobs_of_owner, session_s;
    /* [retention] */
    int64_t retention_max_age_days, retention_max_bytes, retention_check_s;
    /* [backup] */
    int64_t backup_every_s, backup_keep, backup_keep_days;
    char backup_folder[SETTING_TEXT_BYTES];
    /* [report] */
    char report_laboratory[SETTING_TEXT_BYTES], report_logo[SETTING_TEXT_BYTES], report_paper[SETTING_TEXT_BYTES];
    /* [disk] */
    int64_t floor_bytes, ballast_bytes;
};

/* Sets all defaults. */
void settings_init(struct settings *s);
/* STATUS_INVALID for an unknown key (named in err->field) or a value outside its range, STATUS_IO when the file
 * cannot be read. */
status settings_read_file(struct settings *s, const char *path, struct error *err);
/* key is "section.name". STATUS_INVALID as above. */
status settings_set(struct settings *s, const char *key, const char *value, struct error *err);
/* Prints the table with the defaults as a configuration file. */
void settings_print(FILE *out);

#endif
