/* The command line of `selvedge`: the tables of commands and options. The source file is included here, because the
 * parts of the client are in no library. */
#include "clients/cli/arguments/cli_command_table.c" /* NOLINT */
#include "clients/cli/arguments/cli_option_table.c"  /* NOLINT */
#include "clients/cli/arguments/cli_parse.c"         /* NOLINT */
#include "clients/cli/arguments/cli_tool.c"          /* NOLINT */
#include "clients/cli/text/cli_text.c"               /* NOLINT */

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

#define PARSE(...) parse((char *const[]){"selvedge", __VA_ARGS__, NULL})

static struct cli_args args;
static struct error err;

static status parse(char *const *argv)
{
    int argc = 0;
    while (argv[argc] != NULL) argc++;
    memset(&err, 0, sizeof err);
    return cli_args_parse(argc, argv, &(struct cli_environment){NULL, NULL, NULL}, &args, &err);
}

static void test_commands(void **state)
{
    (void)state;
    assert_int_equal(PARSE("submit", "job.json", "--input-dir", "in", "--watch"), STATUS_OK);
    assert_int_equal(args.command, CLI_SUBMIT);
    assert_string_equal(args.operand, "job.json");
    assert_string_equal(args.input_dir, "in");
    assert_true(args.watch);
    assert_string_equal(args.server, CLI_DEFAULT_SERVER);
    assert_null(args.token);
    assert_int_equal(PARSE("--server=https://cloth.example:1/", "results", "abc", "-o", "out"), STATUS_OK);
    assert_string_equal(args.server, "https://cloth.example:1/");
    assert_string_equal(args.out_dir, "out");
    assert_int_equal(PARSE("submit", "--resume", "5e0c"), STATUS_OK);
    assert_null(args.operand);
    assert_int_equal(PARSE("log", "-f", "5e0c"), STATUS_OK);
    assert_true(args.follow);
    assert_int_equal(PARSE("reconstruct", "scan.tif", "--voxel-um", "2,2,3", "--axes", "xzy", "--align", "-o", "o"),
                     STATUS_OK);
    assert_int_equal(args.command, CLI_RECONSTRUCT);
    assert_string_equal(args.voxel_um, "2,2,3");
    assert_string_equal(args.axes, "xzy");
    assert_true(args.align);
    assert_int_equal(PARSE("status", "--", "-odd"), STATUS_OK);
    assert_string_equal(args.operand, "-odd");
}

static void test_environment(void **state)
{
    (void)state;
    char *const argv[] = {"selvedge", "list", NULL};
    assert_int_equal(cli_args_parse(2, argv, &(struct cli_environment){"http://h:1", "secret", "file"}, &args, &err),
                     STATUS_OK);
    assert_string_equal(args.server, "http://h:1");
    assert_string_equal(args.token, "secret");
    assert_string_equal(args.token_file, "file");
    assert_int_equal(cli_args_parse(2, argv, &(struct cli_environment){"", "", ""}, &args, &err), STATUS_OK);
    assert_string_equal(args.server, CLI_DEFAULT_SERVER);
    assert_null(args.token);
    assert_null(args.token_file);
    char *const over[] = {"selvedge", "list", "--server", "http://o:2", "--token-file", "t", NULL};
    assert_int_equal(cli_args_parse(6, over, &(struct cli_environment){"http://h:1", NULL, "file"}, &args, &err),
                     STATUS_OK);
    assert_string_equal(args.server, "http://o:2");
    assert_string_equal(args.token_file, "t");
    assert_int_equal(PARSE("token", "make", "ann", "--scope", "submit", "--jobs=3"), STATUS_OK);
    assert_int_equal(args.command, CLI_TOKEN);
    assert_string_equal(args.operand, "make");
    assert_string_equal(args.second, "ann");
    assert_string_equal(args.scope, "submit");
    assert_string_equal(args.jobs, "3");
}

static void expect_error(status s, const char *part)
{
    assert_int_equal(s, STATUS_INVALID);
    if (strstr(err.text, part) == NULL) fail_msg("'%s' does not say '%s'", err.text, part);
}

static void test_errors(void **state)
{
    (void)state;
    expect_error(PARSE("sumbit", "a"), "did you mean 'submit'");
    expect_error(PARSE("frobnicate"), "--help");
    expect_error(PARSE("submit"), "needs a job document");
    expect_error(PARSE("reconstruct"), "needs a scan");
    expect_error(PARSE("watch"), "needs a job id");
    expect_error(PARSE("watch", "a", "b"), "'b' follows 'a'");
    expect_error(PARSE("list", "a"), "takes no 'a'");
    expect_error(PARSE("list", "--follow"), "no option '--follow'");
    expect_error(PARSE("list", "--lmit"), "unknown option '--lmit'; try --help");
    expect_error(PARSE("list", "--verdit=good"), "unknown option '--verdit'; did you mean '--verdict'?");
    expect_error(PARSE("list", "--jsn"), "unknown option '--jsn'; did you mean '--json'?");
    expect_error(PARSE("watch", "a", "--verdit"), "unknown option '--verdit'; try --help"); /* watch has no --verdict */
    expect_error(PARSE("watch", "a", "--colour"), "unknown option '--colour'");
    expect_error(PARSE("results", "a", "--out"), "needs a value");
    expect_error(PARSE("results", "a", "--out="), "empty value");
    expect_error(PARSE("submit", "a", "--watch=yes"), "takes no value");
    expect_error(PARSE("list", "--server", "ftp://x"), "not an http");
    char *const none[] = {"selvedge", NULL};
    expect_error(parse(none), "no command");
}

static void test_help(void **state)
{
    (void)state;
    char text[8192], small[40];
    assert_int_equal(PARSE("--help"), STATUS_OK);
    assert_true(args.help && !args.has_command);
    cli_help(&args, text, sizeof text);
    for (int i = 0; i < CLI_N_COMMAND; i++) assert_non_null(strstr(text, cli_command_table[i].name));
    for (int i = 0; i < CLI_N_COMMAND; i++) { /* every command has its help, also when its operand is missing */
        char *const argv[] = {"selvedge", (char *)(uintptr_t)cli_command_table[i].name, "--help", NULL};
        assert_int_equal(parse(argv), STATUS_OK);
        assert_true(args.help && args.has_command);
        cli_help(&args, text, sizeof text);
        assert_non_null(strstr(text, "--server URL"));
        assert_non_null(strstr(text, cli_command_table[i].name));
        cli_help(&args, small, sizeof small); /* truncated, not overrun */
        assert_true(strlen(small) < sizeof small);
    }
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_commands),
        cmocka_unit_test(test_environment),
        cmocka_unit_test(test_errors),
        cmocka_unit_test(test_help),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
