/* Texts about batches. */
#include "clients/cli/batch/cli_batch.h"
#include "clients/cli/text/cli_text.h"

#include <string.h>
#include <time.h>

static const char *text_of(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text == NULL ? "" : text;
}

static void print_line(FILE *out, const char *label, const char *text)
{
    char clean[1400];
    text_clean(text, clean, sizeof clean);
    fprintf(out, "%-10s %s\n", label, clean);
}

void cli_batch_numbers(const json_t *object, char *out, size_t n_out)
{
    const char *key;
    json_t *value;
    size_t n = 0;
    out[0] = '\0';
    json_object_foreach((json_t *)(uintptr_t)object, key, value) if (json_integer_value(value) > 0 && n < n_out) n +=
        (size_t)snprintf(out + n, n_out - n, "%s%lld %s", n == 0 ? "" : ", ", (long long)json_integer_value(value),
                         key);
}

void cli_batch_print(const struct cli *cli, const json_t *batch)
{
    char text[1400], numbers[300];
    json_t *one;
    size_t i;
    FILE *out = cli->out;
    print_line(out, "batch", text_of(batch, "name"));
    print_line(out, "id", text_of(batch, "id"));
    cli_batch_numbers(json_object_get(batch, "states"), numbers, sizeof numbers);
    snprintf(text, sizeof text, "%lld: %s", (long long)json_integer_value(json_object_get(batch, "n_sample")), numbers);
    print_line(out, "samples", text);
    snprintf(text, sizeof text, "%.1f %%", 100 * json_number_value(json_object_get(batch, "fraction")));
    print_line(out, "done", text);
    const json_t *end = json_object_get(batch, "expected_end_unix_s");
    time_t end_s = (time_t)json_number_value(end);
    struct tm local;
    if (json_is_number(end) && localtime_r(&end_s, &local) != NULL &&
        strftime(text, sizeof text, "about %Y-%m-%d %H:%M", &local) > 0)
        print_line(out, "ends", text);
    cli_batch_numbers(json_object_get(batch, "verdicts"), numbers, sizeof numbers);
    if (numbers[0] != '\0') print_line(out, "verdicts", numbers);
    json_array_foreach(json_object_get(batch, "failures"), i, one)
    {
        const char *field = text_of(one, "field");
        snprintf(text, sizeof text, "%s: %s%s%s", text_of(one, "sample"), field, field[0] == '\0' ? "" : ": ",
                 text_of(one, "text"));
        print_line(out, "failed", text);
    }
    json_array_foreach(json_object_get(batch, "refused"), i, one)
    {
        snprintf(text, sizeof text, "%s: %s", text_of(one, "sample"), text_of(one, "detail"));
        print_line(out, "refused", text);
    }
}
