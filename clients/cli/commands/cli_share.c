/* selvedge share ID: a link that shows one job to someone without a token. */
#include "clients/cli/commands/cli.h"
#include "clients/cli/text/cli_text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* "2026-12-29 14:05" in the reader's zone. */
static void date_of(double unix_s, char text[32])
{
    const time_t t = (time_t)unix_s;
    struct tm local;
    text[0] = '\0';
    if (localtime_r(&t, &local) != NULL) strftime(text, 32, "%Y-%m-%d %H:%M", &local);
}

static double number_of(const json_t *share, const char *key) { return json_number_value(json_object_get(share, key)); }

static status make(struct cli *cli, const char *path, struct error *err)
{
    json_t *body = json_object(), *share = NULL;
    char until[32], *end = NULL;
    const char *days = cli->args->days;
    const double n = days != NULL ? strtod(days, &end) : NAN;
    status s = STATUS_OK;
    if (days != NULL && (end == days || *end != '\0' || !(n > 0.0) || !isfinite(n)))
        s = error_set(err, STATUS_INVALID, "option '--days' takes a number above 0: '%s'", days);
    if (days != NULL) json_object_set_new(body, "days", json_real(n));
    if (s == STATUS_OK) s = http_json(cli->http, "POST", path, NULL, body, &share, err);
    const char *secret = json_string_value(json_object_get(share, "secret"));
    if (s == STATUS_OK && secret == NULL) s = error_set(err, STATUS_FORMAT, "the server's reply has no link");
    if (s == STATUS_OK) {
        date_of(number_of(share, "expires_unix_s"), until);
        fprintf(cli->out, "%s/#share/%s\n", http_server(cli->http), secret);
        fprintf(cli->note, "valid until %s; it is not shown again\n", until);
        if (json_is_false(json_object_get(share, "protected")))
            fputs("no access tokens are in use: whoever reaches this server sees every job, with or without a link\n",
                  cli->note);
    }
    json_decref(body);
    json_decref(share);
    return s;
}

/* Lists the links that are valid, and revokes them with --revoke. */
static status list(struct cli *cli, const char *path, bool revoke, struct error *err)
{
    json_t *answer = NULL;
    const json_t *share;
    size_t i, n = 0;
    status s = http_json(cli->http, "GET", path, NULL, NULL, &answer, err);
    json_array_foreach(json_object_get(answer, "shares"), i, share)
    {
        char until[32], one[512], by[80];
        const char *id = json_string_value(json_object_get(share, "id"));
        if (s != STATUS_OK || id == NULL || !json_is_true(json_object_get(share, "open"))) continue;
        n++;
        date_of(number_of(share, "expires_unix_s"), until);
        text_clean(json_string_value(json_object_get(share, "made_by")), by, sizeof by);
        snprintf(one, sizeof one, "%.300s/%.100s", path, id);
        if (revoke) s = http_json(cli->http, "DELETE", one, NULL, NULL, NULL, err);
        if (s == STATUS_OK)
            fprintf(cli->out, "%s until %s%s%s\n", revoke ? "revoked: valid" : "valid", until,
                    by[0] != '\0' ? ", made by " : "", by);
    }
    if (s == STATUS_OK && n == 0) fputs("no link shows this job\n", cli->note);
    json_decref(answer);
    return s;
}

CLI_COMMAND(
    SHARE, cli_share, .place = 105, .name = "share", .operand = "ID", .options = "days revoke links",
    .summary = "a link that shows a job and its results to someone without a token",
    .text =
        "Prints an address that shows this one job, read only, for --days N (default: 30). --links lists the links\n"
        "that are valid, --revoke ends all of them.\n")

status cli_share(struct cli *cli, int *exit_code, struct error *err)
{
    char path[256];
    (void)exit_code;
    status s = cli_job_path(cli->args->operand, "/shares", path, sizeof path, err);
    if (s != STATUS_OK) return s;
    return cli->args->revoke || cli->args->links ? list(cli, path, cli->args->revoke, err) : make(cli, path, err);
}
