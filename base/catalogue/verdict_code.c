#include "base/catalogue/verdict_code.h"

#include <stddef.h>
#include <string.h>

static const struct {
    const char *id, *words;
} known[VERDICT_N_CODE] = {
    [VERDICT_NONE] = {"none", "none"},
    [VERDICT_GOOD] = {"good", "good"},
    [VERDICT_GOOD_BUT_UNDETERMINED] = {"good_but_undetermined", "good, but some parameters are undetermined"},
    [VERDICT_PICTURES_ONLY] = {"pictures_only", "usable for pictures only"},
    [VERDICT_DOES_NOT_DESCRIBE] = {"does_not_describe_this_cloth", "does not describe this cloth"},
};

const char *verdict_code_id(enum verdict_code code) { return known[code].id; }

const char *verdict_code_words(enum verdict_code code) { return known[code].words; }

bool verdict_code_parse(const char *id, enum verdict_code *code)
{
    for (int i = 0; i < VERDICT_N_CODE; i++)
        if (strcmp(id, known[i].id) == 0) {
            *code = (enum verdict_code)i;
            return true;
        }
    *code = strcmp(id, VERDICT_OLD_USABLE) == 0 ? VERDICT_PICTURES_ONLY : VERDICT_NONE;
    return *code != VERDICT_NONE;
}
