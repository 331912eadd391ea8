/* selvedge, the command line client. It communicates with the daemon only through HTTP. */
#include "base/version.h"
#include "clients/cli/arguments/cli_parse.h"
#include "clients/cli/arguments/cli_tool.h"
#include "clients/cli/commands/cli.h"
#include "clients/cli/text/cli_text.h"
#include "clients/cli/text/text_table.h"

#include <curl/curl.h>
#include <locale.h>
#include <poll.h>
#include <signal.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static volatile sig_atomic_t interrupted; /* written only by the signal handler */

static void on_signal(int number)
{
    if (interrupted) _exit(128 + number); /* a second signal ends the program at once */
    interrupted = 1;
}

static status (*const run[CLI_N_COMMAND])(struct cli *, int *, struct error *) = {
#undef CLI_COMMAND
#define CLI_COMMAND(id, run, ...) [CLI_##id] = run,
#include "generated/cli_commands.def"
#undef CLI_COMMAND
};

static void print_error(const struct error *err)
{
    char field[sizeof err->field], text[sizeof err->text];
    text_clean(err->field, field, sizeof field);
    text_clean(err->text, text, sizeof text);
    /* print the field only if the server's sentence does not contain it */
    const bool named = field[0] == '\0' || strstr(text, field) != NULL;
    text_put_word("error", text_colored(stderr), stderr);
    fprintf(stderr, ": %s%s%s\n", named ? "" : field, named ? "" : ": ", text);
}

/* Whether the program behind a pipe, such as `head`, has read enough and ended. */
static bool reader_is_gone(void)
{
    struct pollfd out = {.fd = STDOUT_FILENO, .events = POLLOUT};
    return poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0;
}

static int execute(const struct cli_args *given)
{
    struct cli_args whole = *given, *args = &whole;
    char id[CLI_ID_BYTES];
    struct error err = {0};
    int exit_code = CLI_EXIT_OK;
    struct cli cli = {.args = args, .out = stdout, .note = stderr, .note_is_terminal = isatty(STDERR_FILENO) == 1};
    char *token = NULL;
    status s = args->token_file == NULL ? STATUS_OK : cli_token_read(args->token_file, &token, &err);
    if (s == STATUS_OK) s = http_new(args->server, token != NULL ? token : args->token, &interrupted, &cli.http, &err);
    if (token != NULL) sodium_memzero(token, strlen(token));
    free(token);
    if (s == STATUS_OK && cli_operand_is_id(args->command) && args->operand != NULL) {
        s = cli_whole_id(&cli, args->operand, id, &err);
        args->operand = id;
    }
    if (s == STATUS_OK) s = run[args->command](&cli, &exit_code, &err);
    http_free(cli.http);
    if ((fflush(stdout) != 0 || ferror(stdout)) && reader_is_gone()) return s == STATUS_OK ? exit_code : CLI_EXIT_ERROR;
    if (s == STATUS_OK && (fflush(stdout) != 0 || ferror(stdout)))
        s = error_set(&err, STATUS_IO, "cannot write to standard output");
    if (s == STATUS_OK) return exit_code;
    print_error(&err);
    return s == STATUS_CANCELLED ? CLI_EXIT_INTERRUPTED : CLI_EXIT_ERROR;
}

/* Returns only if another program does not take over. */
static int run_tool(char **argv)
{
    char text[2048];
    struct error err = {0};
    const bool asks = argv[2] != NULL && (strcmp(argv[2], "--help") == 0 || strcmp(argv[2], "-h") == 0);
    if (asks && cli_tool_help(argv[1], text, sizeof text)) {
        fputs(text, stdout);
        return CLI_EXIT_OK;
    }
    cli_tool_run(argv, &err);
    print_error(&err);
    return CLI_EXIT_ERROR;
}

int main(int argc, char **argv)
{
    struct cli_args args;
    struct error err = {0};
    setlocale(LC_CTYPE, "");
    if (argc >= 2 && cli_tool_knows(argv[1])) return run_tool(argv);
    if (argc >= 3 && strcmp(argv[1], "help") == 0 && cli_tool_knows(argv[2]))
        return run_tool((char *[]){argv[0], argv[2], (char[]){"--help"}, NULL});
    const struct cli_environment env = {getenv("SELVEDGE_SERVER"), getenv("SELVEDGE_TOKEN"),
                                        getenv("SELVEDGE_TOKEN_FILE")};
    if (cli_args_parse(argc, argv, &env, &args, &err) != STATUS_OK) {
        print_error(&err);
        return CLI_EXIT_USAGE;
    }
    if (args.help) {
        char text[8192];
        cli_help(&args, text, sizeof text);
        fputs(text, stdout);
        return CLI_EXIT_OK;
    }
    if (args.version) {
        puts("selvedge " SELVEDGE_VERSION);
        return CLI_EXIT_OK;
    }
    struct sigaction action = {.sa_handler = on_signal};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    if (sodium_init() < 0 || curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK) {
        fputs("error: cannot start libsodium or libcurl\n", stderr);
        return CLI_EXIT_ERROR;
    }
    int exit_code = execute(&args);
    curl_global_cleanup();
    return exit_code;
}
