#include "optimizer/tools/phantom/phantom_commands.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_OPTION = 48, OPTION_CODE = 256 }; /* code of the first option in getopt_long */

/* Reads up to n comma-separated numbers. The last one fills the rest of the list. */
static bool parse_list(const char *text, double *to, size_t n)
{
    size_t i = 0;
    for (;;) {
        char *end;
        double v = strtod(text, &end);
        if (end == text || !isfinite(v) || i == n) return false;
        to[i++] = v;
        if (*end == '\0') break;
        if (*end != ',') return false;
        text = end + 1;
    }
    for (; i < n; i++) to[i] = to[i - 1];
    return true;
}

static bool parse_counts(const char *text, size_t *to, size_t n)
{
    double v[8];
    if (n > 8 || !parse_list(text, v, n)) return false;
    for (size_t i = 0; i < n; i++) {
        if (v[i] < 0.0 || v[i] > 1e15 || v[i] != floor(v[i])) return false;
        to[i] = (size_t)v[i];
    }
    return true;
}

static bool parse_u64(const char *text, uint64_t *to)
{
    char *end;
    errno = 0;
    *to = strtoull(text, &end, 10);
    return end != text && *end == '\0' && text[0] != '-' && errno == 0;
}

static status set_option(const struct command_option *o, const char *value, struct error *err)
{
    size_t n = o->n > 0 ? o->n : 1;
    bool ok = true;
    switch (o->kind) {
    case OPTION_TEXT:
        *(const char **)o->to = value;
        break;
    case OPTION_NUMBER:
        ok = parse_list(value, o->to, 1);
        break;
    case OPTION_NUMBER_LIST:
        ok = parse_list(value, o->to, n);
        break;
    case OPTION_COUNT:
        ok = parse_counts(value, o->to, n);
        break;
    case OPTION_U64:
        ok = parse_u64(value, o->to);
        break;
    case OPTION_FLAG:
        *(bool *)o->to = true;
        break;
    case OPTION_FALSE:
        *(bool *)o->to = false;
        break;
    case OPTION_CALL:
        return o->call(o->to, value, err);
    }
    if (ok) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, o->name, "option --%s does not take '%s'", o->name, value);
}

/* The error of the option at which getopt_long stopped. code: its return value, ':' or '?'; word is the last argument
 * that it read. */
static status option_fault(int code, const char *word, const struct command_option *option, struct error *err)
{
    if (optopt < OPTION_CODE) return error_set(err, STATUS_INVALID, "unknown option '%s'", word);
    return error_set(err, STATUS_INVALID, "option --%s %s", option[optopt - OPTION_CODE].name,
                     code == ':' ? "needs a value" : "takes no value");
}

status command_options_parse(int argc, char **argv, const struct command_option *option, size_t n_option,
                             struct error *err)
{
    struct option named[MAX_OPTION + 1] = {{0}};
    if (n_option > MAX_OPTION) return error_set(err, STATUS_INTERNAL, "a command has too many options");
    for (size_t i = 0; i < n_option; i++) {
        bool flag = option[i].kind == OPTION_FLAG || option[i].kind == OPTION_FALSE;
        named[i] = (struct option){option[i].name, flag ? no_argument : required_argument, NULL, OPTION_CODE + (int)i};
    }
    optind = 0; /* restarts getopt_long */
    for (int code; (code = getopt_long(argc, argv, "+:", named, NULL)) != -1;) {
        status s = code >= OPTION_CODE ? set_option(&option[code - OPTION_CODE], optarg, err)
                                       : option_fault(code, argv[optind - 1], option, err);
        if (s != STATUS_OK) return s;
    }
    if (optind < argc) return error_set(err, STATUS_INVALID, "unknown option '%s'", argv[optind]);
    return STATUS_OK;
}
