#include "base/word_guess.h"

#include <stdbool.h>
#include <string.h>
#include <strings.h>

size_t word_distance(const char *a, const char *b)
{
    size_t row[32], n_b = strlen(b);
    if (n_b >= 32 || strlen(a) >= 32) return 99;
    for (size_t j = 0; j <= n_b; j++) row[j] = j;
    for (size_t i = 1; a[i - 1] != '\0'; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= n_b; j++) {
            size_t best = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            if (row[j] + 1 < best) best = row[j] + 1;
            if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
            row[j] = best;
        }
    }
    return row[n_b];
}

static bool begins_alike(const char *a, const char *b)
{
    size_t n_a = strlen(a), n_b = strlen(b), n = n_a < n_b ? n_a : n_b;
    return n >= 3 && strncmp(a, b, n) == 0;
}

const char *word_guess(const char *word, const char *const *list)
{
    const char *nearest = NULL, *longer = NULL;
    size_t least = 3, n_longer = 0;
    for (; *list != NULL; list++) {
        if (strcasecmp(word, *list) == 0) return *list;
        size_t d = word_distance(word, *list);
        if (d < least && 3 * d <= strlen(*list)) least = d, nearest = *list;
        if (begins_alike(word, *list)) longer = *list, n_longer++;
    }
    return nearest != NULL ? nearest : n_longer == 1 ? longer : NULL;
}
