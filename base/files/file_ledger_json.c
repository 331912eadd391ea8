#include "base/files/file_ledger_json.h"
#include "base/files/json_member.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool has_file(const json_t *files, const char *file)
{
    size_t i;
    json_t *item;
    json_array_foreach(files, i,
                       item) if (strcmp(json_string_value(json_object_get(item, "file")), file) == 0) return true;
    return false;
}

void file_ledger_append(json_t *files, const char *file, const struct file_ledger *ledger)
{
    if (files == NULL || ledger->n == 0 || has_file(files, file)) return;
    json_t *statements = json_array();
    for (size_t i = 0; i < ledger->n; i++) {
        const struct file_statement *f = &ledger->item[i];
        json_array_append_new(statements, json_pack("{s:s, s:s, s:s, s:s}", "name", f->name, "value", f->value, "use",
                                                    file_statement_use_name(f->use), "reason", f->reason));
    }
    json_array_append_new(files, json_pack("{s:s, s:o}", "file", file, "statements", statements));
}

/* The statements of one name and use that several files share. */
struct statement_group {
    const json_t *first; /* the statement of the first file */
    const char *file;
    size_t n_file, n_value; /* n_value: files whose value differs from the first one's */
};

static const char *text_of(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text != NULL ? text : "";
}

static bool same(const json_t *a, const json_t *b, const char *key)
{
    return strcmp(text_of(a, key), text_of(b, key)) == 0;
}

/* Adds a statement to its group, or as a group of its own behind the n that there are. Returns their number. */
static size_t group_statement(struct statement_group *group, size_t n, const char *file, const json_t *statement)
{
    size_t i = 0;
    while (i < n && !(same(group[i].first, statement, "name") && same(group[i].first, statement, "use") &&
                      same(group[i].first, statement, "reason")))
        i++;
    if (i == n) group[n++] = (struct statement_group){.first = statement, .file = file};
    group[i].n_file++;
    group[i].n_value += !same(group[i].first, statement, "value");
    return n;
}

static json_t *sentence_of(const struct statement_group *g)
{
    char others[48] = "", values[48] = "";
    const char *reason = text_of(g->first, "reason");
    if (g->n_file > 1)
        snprintf(others, sizeof others, " and %zu other file%s", g->n_file - 1, g->n_file > 2 ? "s" : "");
    if (g->n_value > 0) snprintf(values, sizeof values, " (others state other values)");
    return json_sprintf("%s%s state%s %s %s%s: %s%s", g->file, others, g->n_file > 1 ? "" : "s",
                        text_of(g->first, "name"), text_of(g->first, "value"), values,
                        reason[0] != '\0' ? "not used, " : "applied", reason);
}

json_t *file_ledger_sentences(const json_t *files)
{
    size_t i, k, n = 0;
    json_t *file, *statement, *list = json_array();
    json_array_foreach(files, i, file) n += json_array_size(json_object_get(file, "statements"));
    struct statement_group *group = calloc(n + 1, sizeof *group);
    if (group == NULL) return list;
    n = 0;
    json_array_foreach(files, i, file) json_array_foreach(json_object_get(file, "statements"), k, statement) n =
        group_statement(group, n, text_of(file, "file"), statement);
    for (int applied = 0; applied < 2; applied++)
        for (i = 0; i < n; i++)
            if ((text_of(group[i].first, "reason")[0] == '\0') == applied)
                json_array_append_new(list, sentence_of(&group[i]));
    free(group);
    return list;
}

void file_ledgers_keep(json_t *files)
{
    static const struct json_member of_statement[] = {{"name", JSON_IS_TEXT, false, 0, 0},
                                                      {"value", JSON_IS_TEXT, false, 0, 0},
                                                      {"use", JSON_IS_TEXT, false, 0, 0},
                                                      {"reason", JSON_IS_TEXT, false, 0, 0}},
                                    of_file[] = {{"file", JSON_IS_TEXT, false, 0, 0},
                                                 {"statements", JSON_IS_LIST, false, 0, 0}};
    size_t i;
    json_t *file;
    json_items_keep(files, of_file, sizeof of_file / sizeof *of_file);
    json_array_foreach(files, i, file)
        json_items_keep(json_object_get(file, "statements"), of_statement, sizeof of_statement / sizeof *of_statement);
}
