/* Follows a job: polls with the ETag, prints changes, and reports the outcome. */
#include "base/catalogue/verdict_code.h"
#include "clients/cli/commands/cli.h"
#include "clients/cli/text/cli_report.h"
#include "clients/cli/text/cli_text.h"

#include "base/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

enum { PLAIN_INTERVAL_S = 10, GONE_S = 120 };

struct watch {
    struct cli *cli;
    char path[256], id[80], etag[160];
    json_t *job;                 /* the last complete reply */
    struct job_view view, shown; /* the present state, and the state in the last plain line */
    double shown_s, lost_s;      /* lost_s: time of the first of the failed requests, 0 if the last one succeeded */
    size_t n_warning;            /* number already printed */
    bool drawn;
};

size_t cli_columns(const struct cli *cli)
{
    struct winsize size;
    int fd = fileno(cli->note);
    return fd >= 0 && ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col >= 40 ? size.ws_col : 80;
}

static void wipe(struct watch *w)
{
    if (w->drawn) fputs("\r\033[K", w->cli->note);
    w->drawn = false;
}

static void draw_live(struct watch *w)
{
    char line[512];
    size_t width = cli_columns(w->cli);
    text_progress(&w->view, width - 1, line, sizeof line);
    fprintf(w->cli->note, "\r\033[K%s", line);
    fflush(w->cli->note);
    w->drawn = true;
}

static void draw_plain(struct watch *w)
{
    const struct job_view *a = &w->shown, *b = &w->view;
    double now = clock_monotonic_s();
    bool other = strcmp(a->state, b->state) != 0 || strcmp(a->stage, b->stage) != 0 || a->step != b->step;
    if (!other && now - w->shown_s < PLAIN_INTERVAL_S) return;
    char line[512];
    text_progress_plain(b, line, sizeof line);
    fprintf(w->cli->note, "%s\n", line);
    fflush(w->cli->note);
    w->shown = *b;
    w->shown_s = now;
}

static void draw(struct watch *w)
{
    const json_t *warnings = json_object_get(w->job, "warnings");
    for (; w->n_warning < json_array_size(warnings); w->n_warning++) {
        char clean[640];
        const char *text = json_string_value(json_array_get(warnings, w->n_warning));
        text_clean(text == NULL ? "?" : text, clean, sizeof clean);
        wipe(w);
        fprintf(w->cli->note, "warning: %s\n", clean);
    }
    if (w->cli->note_is_terminal)
        draw_live(w);
    else
        draw_plain(w);
}

static status read_reply(struct watch *w, const struct http_reply *reply, struct error *err)
{
    if (reply->code == 304) return STATUS_OK;
    if (reply->code != 200) return http_problem(reply, err);
    json_t *job = json_loadb(reply->body, reply->n_body, 0, NULL);
    if (!json_is_object(job)) {
        json_decref(job);
        return error_set(err, STATUS_FORMAT, "'%s' is not a selvedge server: its reply is not JSON",
                         http_server(w->cli->http));
    }
    json_decref(w->job);
    w->job = job;
    snprintf(w->etag, sizeof w->etag, "%s", reply->etag);
    report_view(job, &w->view);
    return STATUS_OK;
}

/* The server may be restarted while a job is watched, so the client waits for it, but not for ever. */
static bool may_wait(struct watch *w, const struct error *err)
{
    double now = clock_monotonic_s();
    if (w->job == NULL) return false;
    if (w->lost_s <= 0.0) {
        w->lost_s = now;
        wipe(w);
        fprintf(w->cli->note, "%s; trying again\n", err->text);
    }
    return now - w->lost_s < GONE_S;
}

/* Replies of a server that is starting or stopping, or of a proxy whose server does not run. */
static bool unavailable(long code) { return code == 429 || code == 502 || code == 503 || code == 504; }

static status poll_once(struct watch *w, struct error *err)
{
    char line[200];
    const char *header[2] = {NULL, NULL};
    struct http_reply reply;
    struct error local = {0};
    if (w->etag[0] != '\0') {
        snprintf(line, sizeof line, "If-None-Match: %s", w->etag);
        header[0] = line;
    }
    status s = http_call(w->cli->http, "GET", w->path, header, NULL, 0, &reply, &local);
    if (s == STATUS_OK) {
        bool away = unavailable(reply.code);
        if (!away) w->lost_s = 0.0;
        s = read_reply(w, &reply, &local);
        if (away && may_wait(w, &local)) s = STATUS_OK;
    } else if (reply.cut_off && may_wait(w, &local)) {
        s = STATUS_OK;
    }
    http_reply_release(&reply);
    if (s != STATUS_OK && err != NULL) *err = local;
    return s;
}

static bool ended(const struct job_view *v)
{
    return strcmp(v->state, "succeeded") == 0 || strcmp(v->state, "failed") == 0 ||
           strcmp(v->state, "cancelled") == 0 || strcmp(v->state, "draft") == 0;
}

/* Whether the verdict of a job that has succeeded is at least `least`; NULL: any is. A job without a verdict has none
 * that is good enough. */
static bool is_good_enough(const char *least, const json_t *job)
{
    const char *id = json_string_value(json_object_get(json_object_get(job, "verdict"), "code"));
    enum verdict_code wanted, code;
    if (least == NULL) return true;
    return id != NULL && verdict_code_parse(least, &wanted) && verdict_code_parse(id, &code) && code != VERDICT_NONE &&
           code <= wanted;
}

static status report_outcome(struct watch *w, int *exit_code, struct error *err)
{
    const char *state = w->view.state;
    const json_t *problem = json_object_get(w->job, "error");
    const char *text = json_string_value(json_object_get(problem, "text")),
               *field = json_string_value(json_object_get(problem, "field"));
    if (strcmp(state, "succeeded") == 0) {
        status s = cli_add_result(w->cli, w->job, err);
        if (s != STATUS_OK) return s;
        report_result(w->job, w->cli->out);
        if (!is_good_enough(w->cli->args->require, w->job)) {
            fprintf(w->cli->note, "the verdict is worse than '%s', which --require asks for\n", w->cli->args->require);
            *exit_code = CLI_EXIT_VERDICT;
        }
        fprintf(w->cli->note, "results: selvedge results %s, or %s/#%s\n", w->id, http_server(w->cli->http), w->id);
        return STATUS_OK;
    }
    if (strcmp(state, "draft") == 0)
        return error_set(err, STATUS_CONFLICT,
                         "job %s has not been started; start it with: selvedge submit --resume %s", w->id, w->id);
    if (strcmp(state, "cancelled") == 0) {
        fprintf(w->cli->note, "job %s was cancelled; `selvedge retry %s` continues from its last checkpoint\n", w->id,
                w->id);
        *exit_code = CLI_EXIT_CANCELLED;
        return STATUS_OK;
    }
    return error_set_field(err, STATUS_CONFLICT, field == NULL ? "" : field, "job %s failed: %s", w->id,
                           text == NULL ? "no reason given" : text);
}

status cli_watch_job(struct cli *cli, const char *id, int *exit_code, struct error *err)
{
    struct watch w = {.cli = cli};
    w.shown.step = -2;
    snprintf(w.id, sizeof w.id, "%s", id);
    status s = cli_job_path(id, "", w.path, sizeof w.path, err);
    while (s == STATUS_OK) {
        s = poll_once(&w, err);
        if (http_stopped(cli->http))
            s = error_set(err, STATUS_CANCELLED, "interrupted; the job continues (selvedge cancel %s stops it)", id);
        if (s != STATUS_OK) break;
        if (w.job != NULL && w.lost_s <= 0.0) draw(&w);
        if (w.job != NULL && ended(&w.view)) break;
        http_sleep(cli->http, cli->note_is_terminal ? 0.5 : 1.0);
    }
    wipe(&w);
    if (s == STATUS_OK) s = report_outcome(&w, exit_code, err);
    json_decref(w.job);
    return s;
}

CLI_COMMAND(
    WATCH, cli_watch, .place = 60, .name = "watch", .operand = "ID", .options = "require",
    .summary = "follow a job until it ends",
    .text = "A live progress line in a terminal, one line per change otherwise. Exit status 0 when the job succeeded,\n"
            "1 when it failed, 3 when it was cancelled, 4 when its verdict is worse than --require.\n")

status cli_watch(struct cli *cli, int *exit_code, struct error *err)
{
    return cli_watch_job(cli, cli->args->operand, exit_code, err);
}
