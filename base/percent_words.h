/* A relative error as words for people. */
#ifndef SELVEDGE_BASE_PERCENT_WORDS_H
#define SELVEDGE_BASE_PERCENT_WORDS_H

enum { PERCENT_WORDS_BYTES = 48 };

/* Writes a share and its standard error (0.047 and 0.001) as percentages: "4.7 +- 0.1 %", with as many digits as the
 * standard error has meaning. A share of less than two standard errors is indistinguishable from zero, and reads "below
 * 1.1 %": share plus two standard errors, rounded up to two digits. Without a standard error (NaN or 0) it has three
 * digits, "4.72 %". "-" if the share is not a finite number. */
void percent_words(double share, double se, char out[PERCENT_WORDS_BYTES]);
/* The same without the standard error: "4.7 %", "below 1.1 %". */
void percent_words_short(double share, double se, char out[PERCENT_WORDS_BYTES]);

#endif
