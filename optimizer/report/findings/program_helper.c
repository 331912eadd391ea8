#include "optimizer/report/findings/program_helper.h"

#include <errno.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { WAIT_MS = 50, LONGEST_S = 300 };

struct program_helpers program_helpers_none(void)
{
    return (struct program_helpers){.pdf.order_fd = -1, .blend.order_fd = -1};
}

bool program_helper_run(const struct program_helper *helper, const struct progress *progress)
{
    const struct timespec pause = {0, WAIT_MS * 1000000L};
    if (helper->pid <= 0 || write(helper->order_fd, "g", 1) != 1) return false;
    for (int waited_ms = 0, how = 0; waited_ms < LONGEST_S * 1000; waited_ms += WAIT_MS) {
        pid_t got = waitpid(helper->pid, &how, WNOHANG);
        if (got == helper->pid) return WIFEXITED(how) && WEXITSTATUS(how) == 0;
        if ((got < 0 && errno != EINTR) || progress_cancelled(progress)) return false;
        nanosleep(&pause, NULL);
    }
    return false;
}
