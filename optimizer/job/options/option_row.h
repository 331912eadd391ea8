/* A row of the table of job options (option_table.h). */
#ifndef SELVEDGE_OPTIMIZER_OPTION_ROW_H
#define SELVEDGE_OPTIMIZER_OPTION_ROW_H

#include "base/option_id.h"
#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

struct option_value;

/* The section struct that a row's target is in: JOB_SECTION_scan for struct job_scan (optimizer/job/document). */
enum job_section {
    JOB_SECTION_none, /* an element of a list, or no target */
    JOB_SECTION_scan,
    JOB_SECTION_cloth,
    JOB_SECTION_setup,
    JOB_SECTION_rows,
    JOB_SECTION_profile,
    JOB_SECTION_fit,
    JOB_SECTION_results,
    JOB_N_SECTION
};

/* The JSON values that a key takes, and the type of its target. */
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
    const char *or_word;            /* OPTION_LIST: this word is allowed as well, and means an empty list */
    size_t word_at;                 /* of it: offset of a bool in the section */
    bool may_be_empty;              /* OPTION_SECTION: {} means something, or the check says what it lacks */
    bool stored;                    /* it has a target */
    enum job_section section;       /* of the target */
    size_t at;                      /* offset of the target in the section, or in an element of a list */
    size_t count_at, element_bytes; /* of lists: offset of the count, size of an element */
    double lower, upper;            /* numbers; of lists: upper is the largest number of elements */
    size_t n;                       /* count of numbers; bytes of a text */
    const char *const *choice;      /* NULL-terminated; the first is the default without `standard` and `left_out` */
    const char *(*choice_at)(size_t i);     /* the same for words of a catalogue: NULL after the last */
    const char *removed_word, *removed_why; /* a word that an older version took, and the reason in the error text */
    const char *unit;                       /* "" or NULL: none */
    const char *standard;                   /* the default as JSON; NULL: NaN for a number, else zero or empty */
    const char *left_out;                   /* the behaviour without the key, in words, when there is no default */
    const char *allowed;                    /* in words, when range and choices are not the whole condition */
    const char *items;                      /* name of the elements of a list, or of the object, in errors */
    const char *schema;  /* members of a JSON Schema object, added to those that follow from the kind */
    const char *id;      /* of base/option_id.h; NULL: no other part of the program names this option */
    const char *meaning; /* for people: whole sentences in Markdown */
    /* Checks the value; of a section it runs when all members are read. NULL: no check beyond the row. */
    status (*check)(const struct option_value *v, struct error *err);
};

#endif
