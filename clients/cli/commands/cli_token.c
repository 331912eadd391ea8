/* Access tokens: the file that a token is read from, and `selvedge token`, by which an administrator makes, lists and
 * revokes them. */
#include "base/files/durable.h"
#include "clients/cli/commands/cli.h"
#include "clients/cli/text/text_table.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { TOKEN_FILE_BYTES = 4096 };

status cli_token_read(const char *path, char **token, struct error *err)
{
    struct stat st;
    if (stat(path, &st) == 0 && (st.st_mode & (S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH)) != 0)
        return error_set(err, STATUS_INVALID, "other users may read the token in '%s'; forbid it with: chmod 600 '%s'",
                         path, path);
    if (strncmp(path, "selvedge_", 9) == 0 && access(path, F_OK) != 0)
        return error_set(err, STATUS_INVALID,
                         "a file with the token is needed, not the token itself: other users can read command lines");
    status s = file_read_all(path, TOKEN_FILE_BYTES, token, NULL, err);
    if (s != STATUS_OK) return error_prefix(err, s, "cannot read the access token");
    (*token)[strcspn(*token, "\r\n")] = '\0';
    if ((*token)[0] != '\0') return STATUS_OK;
    free(*token);
    *token = NULL;
    return error_set(err, STATUS_INVALID, "the token file '%s' is empty", path);
}

static status put_number(json_t *body, const char *key, const char *option, const char *text, struct error *err)
{
    if (text == NULL) return STATUS_OK;
    char *end;
    errno = 0;
    long long v = strtoll(text, &end, 10);
    if (*end != '\0' || errno != 0 || v < 0)
        return error_set(err, STATUS_INVALID, "option '--%s' is '%.40s', which is not a whole number", option, text);
    json_object_set_new(body, key, json_integer(v));
    return STATUS_OK;
}

/* Writes the token to a new file that only this user can read. */
static status write_file(const char *path, const char *token, struct error *err)
{
    int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd < 0) return error_set_errno(err, "cannot make '%s'", path);
    size_t n = strlen(token);
    bool good = write(fd, token, n) == (ssize_t)n && write(fd, "\n", 1) == 1 && fsync(fd) == 0;
    status s = good ? STATUS_OK : error_set_errno(err, "cannot write '%s'", path);
    close(fd);
    return s;
}

static status make_token(struct cli *cli, const char *name, struct error *err)
{
    const struct cli_args *a = cli->args;
    if (a->scope == NULL)
        return error_set(err, STATUS_INVALID, "'selvedge token make' needs --scope read, submit or admin");
    if (a->out_dir != NULL && access(a->out_dir, F_OK) == 0)
        return error_set(err, STATUS_EXISTS, "'%s' exists already", a->out_dir);
    json_t *made = NULL, *body = json_pack("{s:s,s:s}", "name", name, "scope", a->scope);
    if (a->owner != NULL) json_object_set_new(body, "owner", json_string(a->owner));
    status s = put_number(body, "requests_per_minute", "requests", a->requests, err);
    if (s == STATUS_OK) s = put_number(body, "stored_bytes", "bytes", a->bytes, err);
    if (s == STATUS_OK) s = put_number(body, "jobs", "jobs", a->jobs, err);
    if (s == STATUS_OK) s = http_json(cli->http, "POST", "/v1/tokens", NULL, body, &made, err);
    const char *token = json_string_value(json_object_get(made, "token"));
    if (s == STATUS_OK && token == NULL) s = error_set(err, STATUS_FORMAT, "the server's reply has no token");
    if (s == STATUS_OK && a->out_dir != NULL)
        s = write_file(a->out_dir, token, err);
    else if (s == STATUS_OK) {
        fprintf(cli->note, "token '%s' with scope %s; it is shown only now:\n", name, a->scope);
        fprintf(cli->out, "%s\n", token);
    }
    json_decref(body);
    json_decref(made);
    return s;
}

enum { DAY_BYTES = 32 };

static const char *day_of(const json_t *token, const char *key, char out[DAY_BYTES])
{
    const json_t *time = json_object_get(token, key);
    time_t t = (time_t)json_number_value(time);
    struct tm day;
    if (!json_is_number(time) || localtime_r(&t, &day) == NULL || strftime(out, DAY_BYTES, "%Y-%m-%d %H:%M", &day) == 0)
        snprintf(out, DAY_BYTES, "-");
    return out;
}

static void print_tokens(const json_t *list, FILE *out)
{
    static const char *const head[] = {"name", "owner", "scope", "made", "last used", "revoked", NULL};
    struct text_table table = {.head = head, .colored = text_colored(out)};
    size_t i;
    const json_t *t;
    json_array_foreach(list, i, t)
    {
        char made[DAY_BYTES], used[DAY_BYTES], revoked[DAY_BYTES];
        text_table_add(&table, (const char *const[]){
                                   json_string_value(json_object_get(t, "name")),
                                   json_string_value(json_object_get(t, "owner")),
                                   json_string_value(json_object_get(t, "scope")), day_of(t, "created_unix_s", made),
                                   day_of(t, "last_used_unix_s", used), day_of(t, "revoked_unix_s", revoked)});
    }
    text_table_print(&table, out);
}

static status list_tokens(struct cli *cli, struct error *err)
{
    json_t *all = json_array();
    char path[96] = "/v1/tokens?limit=500";
    status s = STATUS_OK;
    for (bool more = true; more && s == STATUS_OK;) {
        json_t *page = NULL;
        s = http_json(cli->http, "GET", path, NULL, NULL, &page, err);
        if (s != STATUS_OK) break;
        json_array_extend(all, json_object_get(page, "tokens"));
        const char *cursor = json_string_value(json_object_get(page, "next_cursor"));
        more = cursor != NULL;
        if (more) snprintf(path, sizeof path, "/v1/tokens?limit=500&cursor=%.40s", cursor);
        json_decref(page);
    }
    if (s == STATUS_OK && cli->args->json) {
        json_dumpf(all, cli->out, JSON_INDENT(1));
        fputc('\n', cli->out);
    } else if (s == STATUS_OK)
        print_tokens(all, cli->out);
    json_decref(all);
    return s;
}

static status revoke_token(struct cli *cli, const char *name, struct error *err)
{
    static const char allowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._@-";
    char path[160];
    if (name[0] == '\0' || strlen(name) > 64 || name[strspn(name, allowed)] != '\0')
        return error_set(err, STATUS_INVALID, "'%.80s' is no name of a token", name);
    snprintf(path, sizeof path, "/v1/tokens/%s", name);
    return http_json(cli->http, "DELETE", path, NULL, NULL, NULL, err);
}

CLI_COMMAND(
    TOKEN, cli_token, .place = 160, .name = "token", .operand = "ACTION", .needs = "make, list or revoke",
    .second = "NAME", .options = "scope owner requests bytes jobs json out",
    .summary = "make, list or revoke access tokens",
    .text =
        "selvedge token make NAME --scope SCOPE    prints the token, which is shown only once (--out: into a file)\n"
        "selvedge token list                       all tokens, newest first\n"
        "selvedge token revoke NAME                or its id; the next request with it is refused\n"
        "These need a token with scope admin; the first one is made by `selvedged --make-token NAME`.\n")

status cli_token(struct cli *cli, int *exit_code, struct error *err)
{
    const char *action = cli->args->operand, *name = cli->args->second;
    (void)exit_code;
    bool lists = strcmp(action, "list") == 0;
    if (!lists && strcmp(action, "make") != 0 && strcmp(action, "revoke") != 0)
        return error_set(err, STATUS_INVALID, "'selvedge token' can make, list and revoke, not '%.40s'", action);
    if (lists != (name == NULL))
        return error_set(err, STATUS_INVALID,
                         lists ? "'selvedge token list' takes no name" : "'selvedge token %s' needs a name", action);
    return lists                         ? list_tokens(cli, err)
           : strcmp(action, "make") == 0 ? make_token(cli, name, err)
                                         : revoke_token(cli, name, err);
}
