/* The process that makes report.pdf, as others hold it. */
#ifndef SELVEDGE_OPTIMIZER_PDF_HELPER_H
#define SELVEDGE_OPTIMIZER_PDF_HELPER_H

#include <sys/types.h>

struct pdf_helper {
    pid_t pid;    /* 0: none */
    int order_fd; /* a byte written here starts it */
};

#endif
