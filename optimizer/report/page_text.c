#include "optimizer/report/page_text.h"
#include "base/percent_words.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { LONG_LIST = 12 };

void page_escaped(const char *text, FILE *out)
{
    for (const char *p = text; p != NULL && *p != '\0'; p++) {
        const char *code = *p == '&' ? "&amp;" : *p == '<' ? "&lt;" : *p == '>' ? "&gt;" : *p == '"' ? "&quot;" : NULL;
        if (code != NULL)
            fputs(code, out);
        else
            fputc(*p, out);
    }
}

double page_number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

const char *page_string(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text != NULL ? text : "";
}

void page_value(const json_t *value, FILE *out)
{
    size_t i;
    const json_t *item;
    if (json_is_string(value))
        page_escaped(json_string_value(value), out);
    else if (json_is_number(value))
        fprintf(out, "%.6g", json_number_value(value));
    else if (json_is_boolean(value))
        fputs(json_is_true(value) ? "yes" : "no", out);
    else if (json_is_array(value) && json_array_size(value) > 0) {
        json_array_foreach(value, i, item)
        {
            if (i > 0) fputs(", ", out);
            page_value(item, out);
        }
    } else
        fputs("&ndash;", out);
}

void page_with_error(const json_t *value, const json_t *se, double factor, const char *unit, FILE *out)
{
    if (!json_is_number(value)) {
        fputs("&ndash;", out);
        return;
    }
    double x = factor * json_number_value(value), e = json_is_number(se) ? factor * json_number_value(se) : 0.0;
    int digits = e > 0.0 ? 1 - (int)floor(log10(e)) : 0;
    digits = digits < 0 ? 0 : digits > 8 ? 8 : digits;
    if (e > 0.0)
        fprintf(out, "%.*f &plusmn; %.*f%s", digits, x, digits, e, unit);
    else
        fprintf(out, "%.4g%s", x, unit);
}

void page_percent(const json_t *object, const char *key, FILE *out)
{
    char key_se[64], text[PERCENT_WORDS_BYTES];
    const json_t *value = json_object_get(object, key), *se;
    snprintf(key_se, sizeof key_se, "%s_se", key);
    se = json_object_get(object, key_se);
    if (!json_is_number(value)) {
        fputs("&ndash;", out);
        return;
    }
    percent_words(json_number_value(value), json_is_number(se) ? json_number_value(se) : NAN, text);
    const char *sign = strstr(text, "+-");
    if (sign == NULL)
        fputs(text, out);
    else
        fprintf(out, "%.*s&plusmn;%s", (int)(sign - text), text, sign + 2);
}

static void object_rows(const char *prefix, const json_t *object, FILE *out)
{
    const char *key;
    json_t *value, *of = (json_t *)object; /* the macro takes no pointer to const */
    json_object_foreach(of, key, value)
    {
        char name[200];
        snprintf(name, sizeof name, "%s%s%s", prefix, prefix[0] != '\0' ? "." : "", key);
        if (json_is_object(value)) {
            object_rows(name, value, out);
            continue;
        }
        bool objects = json_is_array(value) && json_is_object(json_array_get(value, 0));
        fputs("<tr><td>", out);
        page_escaped(name, out);
        fputs("</td><td>", out);
        if (objects || json_array_size(value) > LONG_LIST)
            fprintf(out, "list of %zu", json_array_size(value));
        else
            page_value(value, out);
        fputs("</td></tr>\n", out);
    }
}

void page_object(const json_t *object, FILE *out)
{
    fputs("<table>\n", out);
    object_rows("", object, out);
    fputs("</table>\n", out);
}
