#include "clients/cli/text/text_table.h"
#include "clients/cli/text/cli_text.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { CELL_BYTES = 400 };

#define GREEN "\033[32m"
#define YELLOW "\033[33m"
#define RED "\033[31m"
#define BLUE "\033[34m"
#define FAINT "\033[2m"
#define PLAIN "\033[0m"

static const struct {
    const char *word, *color;
} meaning[] = {{"succeeded", GREEN},
               {"running", BLUE},
               {"queued", FAINT},
               {"draft", FAINT},
               {"paused", YELLOW},
               {"cancelled", YELLOW},
               {"failed", RED},
               {"good", GREEN},
               {"good, undetermined", GREEN},
               {"pictures only", YELLOW},
               {"usable", YELLOW},
               {"does not describe", RED},
               {"good_but_undetermined", GREEN},
               {"pictures_only", YELLOW},
               {"does_not_describe_this_cloth", RED},
               {"fault", RED},
               {"error", RED},
               {"warning", YELLOW}};

bool text_colored(FILE *out)
{
    const char *no = getenv("NO_COLOR"), *term = getenv("TERM");
    return isatty(fileno(out)) == 1 && (no == NULL || no[0] == '\0') && term != NULL && strcmp(term, "dumb") != 0;
}

/* "" for a word without a color. */
static const char *color_of(const char *word)
{
    for (size_t i = 0; i < sizeof meaning / sizeof *meaning; i++)
        if (strcmp(word, meaning[i].word) == 0) return meaning[i].color;
    return "";
}

void text_put_word(const char *word, bool colored, FILE *out)
{
    const char *color = colored ? color_of(word) : "";
    fprintf(out, "%s%s%s", color, word, color[0] != '\0' ? PLAIN : "");
}

static const char *title_of(const char *head) { return head + (head[0] == '>' || head[0] == '*'); }

/* The columns that a text takes: the characters of its UTF-8. */
static size_t columns_of(const char *text)
{
    size_t n = 0;
    for (; *text != '\0'; text++) n += ((unsigned char)*text & 0xc0) != 0x80;
    return n;
}

static void widen(size_t *width, const char *text)
{
    const size_t n = columns_of(text);
    if (n > *width) *width = n;
}

void text_table_add(struct text_table *t, const char *const *cell)
{
    json_t *row = json_array();
    for (size_t i = 0; t->head[i] != NULL; i++) {
        char clean[CELL_BYTES];
        text_clean(cell[i], clean, sizeof clean);
        widen(&t->width[i], clean);
        json_array_append_new(row, json_string(clean));
    }
    if (t->row == NULL) t->row = json_array();
    json_array_append_new(t->row, row);
}

static void put_blanks(size_t n, FILE *out)
{
    for (; n > 0; n--) fputc(' ', out);
}

/* The last column needs no blanks behind it. */
static void put_cell(const struct text_table *t, size_t i, const char *text, bool is_title, FILE *out)
{
    const size_t blanks = t->width[i] - columns_of(text);
    if (i > 0) fputs("  ", out);
    if (t->head[i][0] == '>') put_blanks(blanks, out);
    text_put_word(text, t->colored && t->head[i][0] == '*' && !is_title, out);
    if (t->head[i][0] != '>' && t->head[i + 1] != NULL) put_blanks(blanks, out);
}

void text_table_print(struct text_table *t, FILE *out)
{
    size_t k;
    const json_t *row;
    for (size_t i = 0; t->head[i] != NULL; i++) widen(&t->width[i], title_of(t->head[i]));
    if (!t->has_head && json_array_size(t->row) > 0) {
        if (t->colored) fputs(FAINT, out);
        for (size_t i = 0; t->head[i] != NULL; i++) put_cell(t, i, title_of(t->head[i]), true, out);
        fputs(t->colored ? PLAIN "\n" : "\n", out);
        t->has_head = true;
    }
    json_array_foreach(t->row, k, row)
    {
        for (size_t i = 0; t->head[i] != NULL; i++)
            put_cell(t, i, json_string_value(json_array_get(row, i)), false, out);
        fputc('\n', out);
    }
    json_decref(t->row);
    t->row = NULL;
}
