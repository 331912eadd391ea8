/* A library for LD_PRELOAD in tests: libtiff as if a hostile file had taken it over. Opening a TIFF does what the
 * variable HOSTILE says, "read /etc/passwd", and reports "hostile: ..." on stderr. Without an argument it is done to
 * the TIFF. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static void report(const char *act, long result)
{
    dprintf(2, "hostile: %s: %s\n", act, result < 0 ? strerror(errno) : "done");
}

static void show(const char *path)
{
    char text[4096];
    int fd = open(path, O_RDONLY);
    long n = fd < 0 ? -1 : read(fd, text, sizeof text);
    if (n > 0) dprintf(2, "hostile: %.*s\n", (int)n, text);
    report("read", n);
}

/* Waits so that a test can look at the threads from outside. */
static void wait_for_look(void)
{
    dprintf(2, "hostile: waits\n");
    sleep(20);
}

/* Puts another file of the same size in the place of one. */
static void replace(const char *path)
{
    char other[4096];
    struct stat st;
    snprintf(other, sizeof other, "%s.new", path);
    int fd = stat(path, &st) == 0 ? open(other, O_WRONLY | O_CREAT, 0400) : -1;
    for (off_t i = 0; fd >= 0 && i < st.st_size; i++)
        if (write(fd, "x", 1) != 1) fd = -1;
    report("replace", fd < 0 ? -1 : rename(other, path));
}

static void act(const char *what, const char *argument)
{
    if (strcmp(what, "read") == 0) show(argument);
    if (strcmp(what, "wait") == 0) wait_for_look();
    if (strcmp(what, "write") == 0) report(what, open(argument, O_WRONLY | O_CREAT, 0600));
    if (strcmp(what, "overwrite") == 0) report(what, open(argument, O_WRONLY));
    if (strcmp(what, "replace") == 0) replace(argument);
    if (strcmp(what, "remove") == 0) report(what, unlink(argument));
    if (strcmp(what, "link") == 0) report(what, link(argument, getenv("HOSTILE_TO")));
    if (strcmp(what, "socket") == 0) report(what, socket(AF_INET, SOCK_STREAM, 0));
    if (strcmp(what, "chmod") == 0) report(what, chmod(argument, 0777));
    if (strcmp(what, "truncate") == 0) report(what, truncate(argument, 0));
    if (strcmp(what, "kill") == 0) report(what, kill(atoi(argument), SIGTERM));
    if (strcmp(what, "execve") == 0) report(what, execl("/bin/true", "true", (char *)NULL));
    if (strcmp(what, "fork") == 0) report(what, fork());
}

void *TIFFOpenExt(const char *path, const char *mode, void *option);
void *TIFFOpenExt(const char *path, const char *mode, void *option)
{
    (void)mode, (void)option;
    char *text = getenv("HOSTILE"), what[64] = "";
    if (text == NULL || sscanf(text, "%63s", what) != 1) return NULL;
    const char *blank = strchr(text, ' ');
    act(what, blank != NULL ? blank + 1 : path);
    return NULL;
}
