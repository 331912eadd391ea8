#include "optimizer/phantom/phantom_commands.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Up to n comma-separated numbers; the last one given fills the rest. */
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

status command_options_parse(int argc, char **argv, const struct command_option *option, size_t n_option,
                             struct error *err)
{
    for (int i = 1; i < argc; i++) {
        const struct command_option *found = NULL;
        const char *value = NULL;
        if (strncmp(argv[i], "--", 2) == 0) {
            size_t n_name = strcspn(argv[i] + 2, "=");
            for (size_t k = 0; k < n_option && found == NULL; k++)
                if (strlen(option[k].name) == n_name && strncmp(option[k].name, argv[i] + 2, n_name) == 0)
                    found = &option[k];
            if (argv[i][2 + n_name] == '=') value = argv[i] + 3 + n_name;
        }
        if (found == NULL) return error_set(err, STATUS_INVALID, "unknown option '%s'", argv[i]);
        bool flag = found->kind == OPTION_FLAG || found->kind == OPTION_FALSE;
        if (flag && value != NULL) return error_set(err, STATUS_INVALID, "option --%s takes no value", found->name);
        if (!flag && value == NULL) {
            if (i + 1 >= argc) return error_set(err, STATUS_INVALID, "option --%s wants a value", found->name);
            value = argv[++i];
        }
        status st = set_option(found, value, err);
        if (st != STATUS_OK) return st;
    }
    return STATUS_OK;
}
