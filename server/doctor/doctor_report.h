/* The findings of `selvedged --doctor`, and how its examinations run another program. */
#ifndef SELVEDGE_SERVER_DOCTOR_REPORT_H
#define SELVEDGE_SERVER_DOCTOR_REPORT_H

#include "server/settings/settings.h"

#include <stdio.h>

/* DOCTOR_NOTE: something that an operator may want to know; DOCTOR_FAULT: the service or the job would not work. */
enum doctor_grade { DOCTOR_OK, DOCTOR_NOTE, DOCTOR_FAULT, DOCTOR_N_GRADE };

struct doctor {
    const struct settings *settings;
    const char *worker; /* path of the program */
    FILE *out;
    int n[DOCTOR_N_GRADE];
};

/* Prints "ok     subject     text". The text is a sentence without its period; a fault states the remedy. */
void doctor_say(struct doctor *d, enum doctor_grade grade, const char *subject, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Runs a program (argv[0], looked for in PATH without a '/') and reads the first n_text - 1 bytes of its standard
 * output and standard error together. *code: its exit code, or 128 + signal. STATUS_NOT_FOUND, STATUS_IO. */
status doctor_execute(char *const *argv, char *text, size_t n_text, int *code, struct error *err);

/* Processor, memory, descriptors, kernel, clock. */
void doctor_examine_machine(struct doctor *d);
/* Data folder, disk, database, backups, secrets, the worker and its sandbox, dashboard. */
void doctor_examine_service(struct doctor *d);
/* With server.store: the database and the folder that daemons share. */
void doctor_examine_store(struct doctor *d);
/* With jobs.backend = slurm: whether it takes jobs. */
void doctor_examine_cluster(struct doctor *d);
/* A job by its id or by the path of its folder. STATUS_NOT_FOUND. */
status doctor_examine_job(struct doctor *d, const char *job, struct error *err);

#endif
