#include "clients/cli/arguments/cli_parse.h"
#include "base/catalogue/verdict_code.h"
#include "base/word_guess.h"
#include "clients/cli/arguments/cli_option_table.h"
#include "clients/cli/arguments/cli_tool.h"

#include <getopt.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

enum { OPTION_CODE = 256 };

static status find_command(const char *word, enum cli_command_id *id, struct error *err)
{
    size_t best = 99;
    for (int i = 0; i < CLI_N_COMMAND; i++) {
        size_t d = word_distance(word, cli_command_table[i].name);
        if (d < best) best = d, *id = (enum cli_command_id)i;
    }
    if (best == 0) return STATUS_OK;
    const char *meant = cli_command_table[*id].name;
    for (size_t i = 0; i < CLI_N_TOOL; i++) {
        const size_t d = word_distance(word, cli_tool_table[i].name);
        if (d < best) best = d, meant = cli_tool_table[i].name;
    }
    if (best <= 2) return error_set(err, STATUS_INVALID, "unknown command '%s'; did you mean '%s'?", word, meant);
    return error_set(err, STATUS_INVALID, "unknown command '%s'; `selvedge --help` lists them", word);
}

/* The option of a code that getopt_long gives: OPTION_CODE + index, or a letter. NULL: there is none. */
static const struct cli_option *option_of(int code)
{
    if (code >= OPTION_CODE) return &cli_option_table[code - OPTION_CODE];
    for (size_t i = 0; i < CLI_N_OPTION && code != 0; i++)
        if (cli_option_table[i].letter == code) return &cli_option_table[i];
    return NULL;
}

static void apply(struct cli_args *a, const struct cli_option *o, const char *value)
{
    void *at = (char *)a + o->at;
    if (o->value != NULL)
        *(const char **)at = value;
    else
        *(bool *)at = true;
}

/* Letters ("-": operands are returned in their place; ":": a missing value gives a code of its own) and names for
 * getopt_long. */
static void list_options(char letters[2 * CLI_N_OPTION + 3], struct option named[CLI_N_OPTION + 1])
{
    size_t n = (size_t)snprintf(letters, 3, "-:");
    for (int i = 0; i < CLI_N_OPTION; i++) {
        const struct cli_option *o = &cli_option_table[i];
        named[i] = (struct option){o->name, o->value != NULL ? required_argument : no_argument, NULL, OPTION_CODE + i};
        if (o->letter == 0) continue;
        letters[n++] = o->letter;
        if (o->value != NULL) letters[n++] = ':';
        letters[n] = '\0';
    }
    named[CLI_N_OPTION] = (struct option){0};
}

/* An option that nobody has, and the one that was meant: of the command, if it is known already. */
static status unknown_option(const struct cli_args *a, const char *word, struct error *err)
{
    const char *name[CLI_N_OPTION + 1], *meant;
    char given[40];
    size_t n = 0;
    for (size_t i = 0; i < CLI_N_OPTION; i++)
        if (!a->has_command || cli_takes_option(&cli_command_table[a->command], &cli_option_table[i]))
            name[n++] = cli_option_table[i].name;
    name[n] = NULL;
    word += strspn(word, "-");
    snprintf(given, sizeof given, "%.*s", (int)strcspn(word, "="), word);
    meant = word_guess(given, name);
    return meant != NULL ? error_set(err, STATUS_INVALID, "unknown option '--%s'; did you mean '--%s'?", given, meant)
                         : error_set(err, STATUS_INVALID, "unknown option '--%s'; try --help", given);
}

/* Takes an option as getopt_long reports it: code may be ':' (a missing value) or '?'. word is the last one that it has
 * read. */
static status take_option(struct cli_args *a, int code, const char *word, struct error *err)
{
    bool wrong = code == ':' || code == '?';
    const struct cli_option *o = option_of(wrong ? optopt : code);
    if (o == NULL && optopt != 0) return error_set(err, STATUS_INVALID, "unknown option '-%c'; try --help", optopt);
    if (o == NULL) return unknown_option(a, word, err);
    if (code == '?') return error_set(err, STATUS_INVALID, "option '--%s' takes no value", o->name);
    if (code == ':')
        return error_set(err, STATUS_INVALID, "option '--%s' needs a value: --%s %s", o->name, o->name, o->value);
    if (o->value != NULL && optarg[0] == '\0')
        return error_set(err, STATUS_INVALID, "option '--%s' has an empty value", o->name);
    apply(a, o, optarg);
    return STATUS_OK;
}

/* The first word is the command, the second its operand. */
static status take_word(struct cli_args *a, const char *word, struct error *err)
{
    if (!a->has_command && !a->help && strcmp(word, "help") == 0) {
        a->help = true;
        return STATUS_OK;
    }
    if (!a->has_command) {
        status s = find_command(word, &a->command, err);
        a->has_command = s == STATUS_OK;
        return s;
    }
    if (a->operand != NULL && a->second == NULL && cli_command_table[a->command].second != NULL) {
        a->second = word;
        return STATUS_OK;
    }
    if (a->second != NULL && a->third == NULL && cli_command_table[a->command].third != NULL) {
        a->third = word;
        return STATUS_OK;
    }
    if (a->operand != NULL) {
        const char *operand = cli_command_table[a->command].operand;
        return error_set(err, STATUS_INVALID, "'selvedge %s' takes one %s, but '%s' follows '%s'",
                         cli_command_table[a->command].name, operand == NULL ? "command" : operand, word, a->operand);
    }
    a->operand = word;
    return STATUS_OK;
}

static bool is_given(const struct cli_args *a, const struct cli_option *o)
{
    const void *at = (const char *)a + o->at;
    return o->value != NULL ? *(const char *const *)at != NULL : *(const bool *)at;
}

/* "usable", the word before there were the two verdicts in the middle, is known as well. */
static status check_requirement(const struct cli_args *a, struct error *err)
{
    enum verdict_code code;
    if (!verdict_code_parse(a->require, &code) || code < VERDICT_GOOD || code > VERDICT_PICTURES_ONLY)
        return error_set(err, STATUS_INVALID,
                         "--require is '%s': allowed are good, good_but_undetermined and pictures_only", a->require);
    if (a->command == CLI_SUBMIT && !a->watch)
        return error_set(err, STATUS_INVALID, "--require needs --watch: the verdict is known when the job has ended");
    return STATUS_OK;
}

/* Options and operands must belong to the command. */
static status check(const struct cli_args *a, struct error *err)
{
    const struct cli_command *c = &cli_command_table[a->command];
    for (size_t i = 0; i < CLI_N_OPTION; i++)
        if (!cli_takes_option(c, &cli_option_table[i]) && is_given(a, &cli_option_table[i]))
            return error_set(err, STATUS_INVALID, "'selvedge %s' has no option '--%s'", c->name,
                             cli_option_table[i].name);
    bool may_lack = a->command == CLI_SUBMIT && a->resume_id != NULL;
    if (c->operand != NULL && a->operand == NULL && !may_lack)
        return error_set(err, STATUS_INVALID, "'selvedge %s' needs %s: selvedge %s %s", c->name,
                         c->needs != NULL ? c->needs : "a job id (`selvedge list` shows them)", c->name, c->operand);
    if (c->operand == NULL && a->operand != NULL)
        return error_set(err, STATUS_INVALID, "'selvedge %s' takes no '%s'", c->name, a->operand);
    if (a->require != NULL) {
        status s = check_requirement(a, err);
        if (s != STATUS_OK) return s;
    }
    if (strncmp(a->server, "http://", 7) != 0 && strncmp(a->server, "https://", 8) != 0 &&
        strncmp(a->server, "unix:/", 6) != 0)
        return error_set(err, STATUS_INVALID, "server '%s' is not an http://, https:// or unix:/ address", a->server);
    return STATUS_OK;
}

/* The value of a variable of the environment, or NULL if it is unset or empty. */
static const char *set(const char *value) { return value != NULL && value[0] != '\0' ? value : NULL; }

status cli_args_parse(int argc, char *const *argv, const struct cli_environment *env, struct cli_args *args,
                      struct error *err)
{
    const char *server = set(env->server);
    *args = (struct cli_args){.server = server != NULL ? server : CLI_DEFAULT_SERVER,
                              .token = set(env->token),
                              .token_file = set(env->token_file)};
    char letters[2 * CLI_N_OPTION + 3];
    struct option named[CLI_N_OPTION + 1];
    status s = STATUS_OK;
    list_options(letters, named);
    optind = 0; /* start anew */
    for (int code; s == STATUS_OK && (code = getopt_long(argc, argv, letters, named, NULL)) != -1;)
        s = code == 1 ? take_word(args, optarg, err) : take_option(args, code, argv[optind - 1], err);
    while (s == STATUS_OK && optind < argc) s = take_word(args, argv[optind++], err); /* after "--" */
    if (s != STATUS_OK) return s;
    if (args->help || args->version) return STATUS_OK;
    if (!args->has_command) return error_set(err, STATUS_INVALID, "no command given; `selvedge --help` lists them");
    return check(args, err);
}

/* Append to a bounded buffer; *at never passes n. */
static void put(char *text, size_t n, size_t *at, const char *format, ...) __attribute__((format(printf, 4, 5)));
static void put(char *text, size_t n, size_t *at, const char *format, ...)
{
    if (*at >= n) return;
    va_list list;
    va_start(list, format);
    int written = vsnprintf(text + *at, n - *at, format, list);
    va_end(list);
    if (written > 0) *at += (size_t)written;
}

/* The options of a command; NULL: the options of every command, and --version. */
static void put_options(const struct cli_command *command, char *text, size_t n, size_t *at)
{
    const struct cli_command any = {.options = "version"};
    for (size_t i = 0; i < CLI_N_OPTION; i++) {
        const struct cli_option *o = &cli_option_table[i];
        if (!cli_takes_option(command != NULL ? command : &any, o)) continue;
        char left[32];
        snprintf(left, sizeof left, "--%s%s%s", o->name, o->value == NULL ? "" : " ", o->value == NULL ? "" : o->value);
        char letter[5] = "    ";
        if (o->letter != 0) snprintf(letter, sizeof letter, "-%c, ", o->letter);
        put(text, n, at, "  %s%-15s %s\n", letter, left, o->help);
    }
}

void cli_help(const struct cli_args *args, char *text, size_t n_bytes)
{
    size_t at = 0;
    if (args->has_command) {
        char text_of[2048];
        const struct cli_command *c = &cli_command_table[args->command];
        cli_command_text(c, text_of, sizeof text_of);
        put(text, n_bytes, &at, "usage: selvedge %s%s%s [options]\n\n%s.\n%s%s\noptions:\n", c->name,
            c->operand == NULL ? "" : " ", c->operand == NULL ? "" : c->operand, c->summary,
            text_of[0] == '\0' ? "" : "\n", text_of);
        put_options(c, text, n_bytes, &at);
        return;
    }
    put(text, n_bytes, &at,
        "selvedge: fit the scattering of a cloth's fibers, through a selvedged server\n\n"
        "usage: selvedge COMMAND [options]\n\ncommands:\n");
    enum cli_command_id order[CLI_N_COMMAND];
    cli_command_order(order);
    for (int i = 0; i < CLI_N_COMMAND; i++) {
        char left[32];
        const struct cli_command *c = &cli_command_table[order[i]];
        snprintf(left, sizeof left, "%s %s", c->name, c->operand == NULL ? "" : c->operand);
        put(text, n_bytes, &at, "  %-18s %s\n", left, c->summary);
    }
    for (size_t i = 0; i < CLI_N_TOOL; i++) {
        char left[32];
        const struct cli_tool *t = &cli_tool_table[i];
        snprintf(left, sizeof left, "%s %s", t->name, t->operand == NULL ? "" : t->operand);
        put(text, n_bytes, &at, "  %-18s %s (needs no daemon)\n", left, t->summary);
    }
    put(text, n_bytes, &at, "\noptions of every command:\n");
    put_options(NULL, text, n_bytes, &at);
    put(text, n_bytes, &at,
        "\n`selvedge help COMMAND` describes a command. docs/options.md describes the job document.\n"
        "Exit status: 0 done, 1 error or failed job, 2 wrong command line, 3 cancelled job, 4 verdict\n"
        "worse than --require, 130 interrupted.\n");
}
