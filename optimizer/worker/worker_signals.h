/* Signals of a worker: those that ask it to end are taken by the thread of its status (worker_status.h) alone. */
#ifndef SELVEDGE_OPTIMIZER_WORKER_SIGNALS_H
#define SELVEDGE_OPTIMIZER_WORKER_SIGNALS_H

/* Blocks SIGTERM and SIGINT, which the status thread waits for, and ignores SIGPIPE, so that a broken pipe is an error
 * of write. To be called before threads are made. */
void worker_signals_set(void);

#endif
