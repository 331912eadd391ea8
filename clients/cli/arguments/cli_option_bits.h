/* The options of the command line as bits, by which the table of commands says what each takes. */
#ifndef SELVEDGE_CLIENTS_CLI_OPTION_BITS_H
#define SELVEDGE_CLIENTS_CLI_OPTION_BITS_H

enum {
    OPT_SERVER = 1,
    OPT_TOKEN = 2,
    OPT_INPUT = 4,
    OPT_WATCH = 8,
    OPT_RESUME = 16,
    OPT_JSON = 32,
    OPT_OUT = 64,
    OPT_FOLLOW = 128,
    OPT_DRAFT = 256,
    OPT_HELP = 512,
    OPT_VERSION = 1024,
    OPT_ID_FILE = 2048,
    OPT_SCAN = 4096, /* each of several */
    OPT_TEMPLATE = 32768,
    OPT_MARKER = 65536,
    OPT_QUIET = 131072,
    OPT_ONCE = 262144,
    OPT_SCOPE = 524288,
    OPT_OWNER = 1048576,
    OPT_REQUESTS = 2097152,
    OPT_BYTES = 4194304,
    OPT_JOBS = 8388608,
    OPT_MAX_AGE = 16777216,
    OPT_MAX_BYTES = 33554432,
    OPT_YES = 67108864,
    OPT_PICTURE = 134217728, /* each of several */
    OPT_FILTER = 268435456,  /* each of several */
    OPT_BATCH = 536870912,   /* each of several */
    OPT_CORES = 1073741824
};
#define OPT_EVERYWHERE (OPT_SERVER | OPT_TOKEN | OPT_HELP)

#endif
