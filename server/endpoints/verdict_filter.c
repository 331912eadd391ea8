#include "server/endpoints/verdict_filter.h"
#include "base/catalogue/verdict_code.h"
#include "server/http/http_reply.h"

#include <stdio.h>
#include <string.h>

static bool refuse(struct http_request *r, const char *word)
{
    struct error err = {0};
    char shown[41], known[240] = "";
    snprintf(shown, sizeof shown, "%s", word);
    for (char *c = shown; *c != '\0'; c++)
        if (*c < ' ' || *c > '~') *c = '?';
    for (int i = VERDICT_GOOD; i < VERDICT_N_CODE; i++) {
        const size_t n = strlen(known);
        snprintf(known + n, sizeof known - n, "%s, ", verdict_code_id((enum verdict_code)i));
    }
    error_set_field(&err, STATUS_INVALID, "verdict",
                    "query parameter 'verdict' has '%s'; it must be %snone or, for older results, " VERDICT_OLD_USABLE,
                    shown, known);
    reply_problem(r, NULL, &err, NULL);
    return false;
}

bool verdict_filter_read(struct http_request *r, char filter[VERDICT_FILTER_BYTES])
{
    const char *text = MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "verdict");
    filter[0] = '\0';
    if (text == NULL) return true;
    size_t n_out = (size_t)snprintf(filter, VERDICT_FILTER_BYTES, ",");
    for (const char *at = text;; at++) {
        char word[48];
        enum verdict_code code;
        const size_t n = strcspn(at, ",");
        snprintf(word, sizeof word, "%.*s", (int)(n < sizeof word ? n : sizeof word - 1), at);
        if (!verdict_code_parse(word, &code) || n_out + n + 2 >= VERDICT_FILTER_BYTES) return refuse(r, word);
        n_out +=
            (size_t)snprintf(filter + n_out, VERDICT_FILTER_BYTES - n_out, "%s,", code == VERDICT_NONE ? "" : word);
        at += n;
        if (*at == '\0') return true;
    }
}
