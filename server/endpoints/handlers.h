/* The handlers of the endpoints in endpoint_table.c. Each decides exactly one reply. */
#ifndef SELVEDGE_SERVER_HANDLERS_H
#define SELVEDGE_SERVER_HANDLERS_H

#include "server/http/http_request.h"

/* handle_jobs.c */
void handle_create_job(struct http_request *r);
void handle_get_job(struct http_request *r);
void handle_delete_job(struct http_request *r);
void handle_put_document(struct http_request *r);
void handle_start_job(struct http_request *r);
void handle_cancel_job(struct http_request *r);
void handle_retry_job(struct http_request *r);
/* handle_list.c */
void handle_list_jobs(struct http_request *r);
/* handle_tags.c */
void handle_list_tags(struct http_request *r);
void handle_put_tags(struct http_request *r);
void handle_act_on_jobs(struct http_request *r);
/* handle_batches.c */
void handle_list_batches(struct http_request *r);
void handle_submit_batch(struct http_request *r);
void handle_get_batch(struct http_request *r);
void handle_delete_batch(struct http_request *r);
void handle_start_batch(struct http_request *r);
void handle_retry_batch(struct http_request *r);
void handle_cancel_batch(struct http_request *r);
void handle_batch_plan(struct http_request *r);
void handle_batch_results(struct http_request *r);
void handle_batch_csv(struct http_request *r);
/* handle_files.c */
void handle_list_files(struct http_request *r);
void handle_declare_files(struct http_request *r);
void handle_get_file(struct http_request *r);
void handle_delete_file(struct http_request *r);
/* handle_inputs.c */
void handle_check_document(struct http_request *r);
void handle_check_job(struct http_request *r);
void handle_plan_job(struct http_request *r);
/* Judges the files of a job that is to be started. Returns false after deciding a reply: 422 with all faults, or why
 * they could not be judged. */
bool check_inputs(struct http_request *r);
void handle_find_input(struct http_request *r);
/* handle_uploads.c */
void handle_upload_offset(struct http_request *r);
void handle_upload_begin(struct http_request *r);
void handle_upload_end(struct http_request *r);
void handle_upload_delete(struct http_request *r);
void handle_upload_options(struct http_request *r);
/* The connection broke during a PATCH: commits the bytes that have arrived. */
void handle_upload_abandoned(struct http_request *r);
/* handle_results.c */
void handle_series(struct http_request *r);
void handle_log(struct http_request *r);
void handle_list_results(struct http_request *r);
void handle_get_result(struct http_request *r);
void handle_archive(struct http_request *r);
/* Sends an open file of a job, which is sandboxed whatever its type. Pages may show pictures and styles beside them. */
void reply_foreign_file(struct http_request *r, int fd, const char *name);
/* handle_versions.c */
void handle_list_versions(struct http_request *r);
void handle_get_version(struct http_request *r);
void handle_version_file(struct http_request *r);
/* handle_deliveries.c */
void handle_list_deliveries(struct http_request *r);
/* handle_tokens.c */
void handle_list_tokens(struct http_request *r);
void handle_make_token(struct http_request *r);
void handle_revoke_token(struct http_request *r);
/* handle_session.c */
void handle_get_session(struct http_request *r);
void handle_sign_in(struct http_request *r);
void handle_sign_out(struct http_request *r);
/* handle_retention.c */
void handle_plan_retention(struct http_request *r);
void handle_remove_by_retention(struct http_request *r);
void handle_list_removals(struct http_request *r);
void handle_keep_job(struct http_request *r);
void handle_unkeep_job(struct http_request *r);
/* handle_service.c */
void handle_about(struct http_request *r);
void handle_options(struct http_request *r);
void handle_openapi(struct http_request *r);
void handle_livez(struct http_request *r);
void handle_readyz(struct http_request *r);
void handle_metrics(struct http_request *r);
void handle_static(struct http_request *r);

#endif
