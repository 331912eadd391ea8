#include "base/natural_order.h"

#include <stdio.h>
#include <string.h>

enum { SHOWN_BYTES = 26 };
static const char digits[] = "0123456789";

/* Compares the numbers that two names go on with, and moves past them. */
static int compare_numbers(const char **a, const char **b)
{
    const char *x = *a + strspn(*a, "0"), *y = *b + strspn(*b, "0");
    const size_t n = strspn(x, digits), m = strspn(y, digits);
    *a = x + n;
    *b = y + m;
    return n != m ? (n < m ? -1 : 1) : strncmp(x, y, n);
}

int natural_compare(const char *a, const char *b)
{
    const char *x = a, *y = b;
    while (*x != '\0' && *y != '\0') {
        int order = 0;
        if (strspn(x, digits) > 0 && strspn(y, digits) > 0)
            order = compare_numbers(&x, &y);
        else if (*x == *y)
            x++, y++;
        else
            order = (unsigned char)*x < (unsigned char)*y ? -1 : 1;
        if (order != 0) return order;
    }
    if (*x != *y) return *x == '\0' ? -1 : 1;
    return strcmp(a, b);
}

int natural_compare_names(const void *a, const void *b)
{
    return natural_compare(*(const char *const *)a, *(const char *const *)b);
}

/* Long names of a set differ at their end. */
static void shorten(const char *name, char out[SHOWN_BYTES + 1])
{
    enum { HEAD = 7 };
    const size_t n = strlen(name);
    if (n <= SHOWN_BYTES)
        memcpy(out, name, n + 1);
    else
        snprintf(out, SHOWN_BYTES + 1, "%.*s...%s", HEAD, name, name + n - (SHOWN_BYTES - HEAD - 3));
}

void natural_order_text(const char *const *name, size_t n, char *text, size_t n_text)
{
    char first[SHOWN_BYTES + 1], second[SHOWN_BYTES + 1], last[SHOWN_BYTES + 1];
    shorten(name[0], first);
    shorten(name[n > 1 ? 1 : 0], second);
    shorten(name[n - 1], last);
    if (n == 1)
        snprintf(text, n_text, "1 file: %s", first);
    else
        snprintf(text, n_text, n > 2 ? "%zu files: %s, %s ... %s" : "%zu files: %s, %s", n, first, second, last);
}
