/* The style sheet of report.html, for screens in light and dark and for print. */
#ifndef SELVEDGE_OPTIMIZER_PAGE_STYLE_H
#define SELVEDGE_OPTIMIZER_PAGE_STYLE_H

#include <stdbool.h>
#include <stdio.h>

/* Writes the style sheet. letter: pages of US Letter, else of A4. */
void page_style(bool letter, FILE *out);

#endif
