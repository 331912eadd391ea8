/* The table of job options: one row for each key of the job document. The rows drive the parser (option_reader.h), the
 * keys that are allowed, and GET /v1/options (option_json.h). From the latter follow the form of the dashboard, the
 * schema JobDocument of config/openapi.json and the table of docs/sample-preparation.md (`make generate`).
 *
 * A new option is a row here, a member of struct job_document, and the place that uses it. Constant data.
 */
#ifndef SELVEDGE_OPTIMIZER_OPTION_TABLE_H
#define SELVEDGE_OPTIMIZER_OPTION_TABLE_H

#include "base/option_id.h"
#include "base/status.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

struct job_document;
struct option_value;

/* What JSON a key takes, and in which form it is stored at its target. */
enum option_kind {
    OPTION_SECTION,          /* an object, whose members are the rows under its path -> bool: true when given */
    OPTION_LIST,             /* a list of objects, whose members are the rows under path[] -> pointer and count */
    OPTION_NUMBER,           /* -> double */
    OPTION_NUMBERS,          /* n numbers -> double[n] */
    OPTION_NUMBER_OR_LIST,   /* one number for all, or n numbers -> double[n] */
    OPTION_COUNT,            /* whole number -> size_t */
    OPTION_COUNTS,           /* n whole numbers -> size_t[n] */
    OPTION_LARGE_COUNT,      /* whole number without an upper limit -> uint64_t */
    OPTION_BOOL,             /* -> bool */
    OPTION_BOOL_OR_LEFT_OUT, /* -> int: 0, 1, or -1 where the key is left out */
    OPTION_CHOICE,           /* one of several words -> enum: index of the word */
    OPTION_SWITCH,           /* one of two words -> bool: the second one */
    OPTION_WORD,             /* one of several words -> char[n]: the word */
    OPTION_TEXT,             /* -> char[n] */
    OPTION_FILE_NAME,        /* -> char[JOB_MAX_NAME_BYTES] */
    OPTION_FILE_NAMES,       /* list -> pointer to char[JOB_MAX_NAME_BYTES] and count */
    OPTION_OWN,              /* read by the check of its section; `schema` describes the value */
    OPTION_N_KIND
};

struct job_option {
    const char *path; /* "lamp.side_cm", "photographs[].scale"; "" for the document itself */
    enum option_kind kind;
    bool required;
    bool or_section;                /* OPTION_BOOL, OPTION_LIST: an object of the rows under path is allowed as well */
    bool stored;                    /* it has a target */
    size_t at;                      /* offset of the target in struct job_document, or in an element of its list */
    size_t count_at, element_bytes; /* of lists: offset of the count, size of an element */
    double lower, upper;            /* numbers; of lists: upper is the largest number of elements */
    size_t n;                       /* count of numbers; bytes of a text */
    const char *const *choice;      /* NULL-terminated; the first is the default without `standard` and `left_out` */
    const char *(*choice_at)(size_t i); /* the same for words of a catalogue: NULL after the last */
    const char *unit;                   /* "" or NULL: none */
    const char *standard;               /* the default as JSON; NULL: NaN for a number, else zero or empty */
    const char *left_out;               /* in words, what holds without the key when there is no default */
    const char *allowed;                /* in words, when range and choices are not the whole condition */
    const char *items;                  /* name of the elements of a list, or of the object, in errors */
    const char *schema;                 /* members of a JSON Schema object, added to those that follow from the kind */
    const char *id;                     /* of base/option_id.h; NULL: no other part of the program names this option */
    const char *meaning;                /* for people: whole sentences in Markdown */
    /* Checks the value; of a section it runs when all members are read. NULL: no check beyond the row. */
    status (*check)(const struct option_value *v, struct error *err);
};

/* A value for a check. It and all options of earlier rows have been read. */
struct option_value {
    const struct job_option *row;
    const json_t *value;
    const char *path; /* "photographs[3].crop_px" */
    void *target;
    struct job_document *doc;
};

/* Row i in the order of the document; NULL after the last. */
const struct job_option *job_option_at(size_t i);
/* The rows of part i, up to one without a path; NULL: there is no such part. JOB_OPTION_EACH walks all rows of the
 * table without searching each from its beginning, as job_option_at does. */
const struct job_option *job_option_part(size_t i);
#define JOB_OPTION_EACH(row)                                                                                           \
    for (size_t i_part_ = 0; job_option_part(i_part_) != NULL; i_part_++)                                              \
        for (const struct job_option *row = job_option_part(i_part_); row->path != NULL; row++)
/* The row of a path of the table; NULL when there is none. */
const struct job_option *job_option_find(const char *path);
/* The key of a row inside its section: "side_cm" for the row "lamp.side_cm" in the section "lamp". The section "" is
 * the document, "photographs[]" an element of a list. NULL when the row does not stand directly in this section. */
const char *job_option_key_in(const struct job_option *row, const char *section);
/* Word i of a choice; NULL after the last. */
const char *job_option_choice(const struct job_option *row, size_t i);

#endif
