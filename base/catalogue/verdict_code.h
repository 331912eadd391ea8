/* Codes of verdicts, from the best to the worst. Results, the API, the command line and the metrics share them; a code
 * never changes its meaning. optimizer/report/findings/verdict.h says when a result gets which one. */
#ifndef SELVEDGE_BASE_VERDICT_CODE_H
#define SELVEDGE_BASE_VERDICT_CODE_H

#include <stdbool.h>

/* VERDICT_NONE: there is nothing to judge, or the verdict is not known. */
enum verdict_code {
    VERDICT_NONE,
    VERDICT_GOOD,
    VERDICT_GOOD_BUT_UNDETERMINED,
    VERDICT_PICTURES_ONLY,
    VERDICT_DOES_NOT_DESCRIBE,
    VERDICT_N_CODE
};

/* The code of results before there were the two in the middle, which it stood for. Filters and readers of stored
 * results know it; new results never have it. */
#define VERDICT_OLD_USABLE "usable"

/* Returns the id: "none", "good", "good_but_undetermined", "pictures_only", "does_not_describe_this_cloth". */
const char *verdict_code_id(enum verdict_code code);
/* Returns the words for people, without the number of undetermined parameters: "usable for pictures only". */
const char *verdict_code_words(enum verdict_code code);
/* Sets the code of an id, "usable" as VERDICT_PICTURES_ONLY; false, and VERDICT_NONE, for any other text. */
bool verdict_code_parse(const char *id, enum verdict_code *code);

#endif
