#include "optimizer/worker/worker_signals.h"

#include <pthread.h>
#include <signal.h>
#include <ucontext.h>
#include <unistd.h>

/* Handles a signal that reaches a thread which a library has started before main (OpenBLAS does, where OpenCV loads it)
 * and which therefore does not block the signal: blocks it in that thread from now on and sends it again, until the
 * status thread's sigtimedwait takes it. */
static void pass_on(int signal_number, siginfo_t *info, void *context)
{
    (void)info;
    ucontext_t *interrupted = context;
    sigaddset(&interrupted->uc_sigmask, signal_number);
    kill(getpid(), signal_number);
}

void worker_signals_set(void)
{
    struct sigaction action = {.sa_sigaction = pass_on, .sa_flags = SA_SIGINFO | SA_RESTART};
    sigset_t set;
    sigemptyset(&action.sa_mask);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    pthread_sigmask(SIG_BLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
}
