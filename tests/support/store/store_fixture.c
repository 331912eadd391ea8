#include "tests/support/store/store_fixture.h"
#include "base/files/durable.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* The process with the server: a line to it asks for a database, a line from it is the address. */
static struct {
    pid_t pid;
    FILE *to, *from;
    char password[256];
} server;

static void chomp(char *line) { line[strcspn(line, "\n")] = '\0'; }

/* The program is BUILD/tests/unit/...; the plug-in is in BUILD/lib. */
static void find_plugin(void)
{
    char path[4096];
    ssize_t n = readlink("/proc/self/exe", path, sizeof path - 1);
    path[n > 0 ? n : 0] = '\0';
    char *tests = strstr(path, "/tests/");
    if (tests != NULL) snprintf(tests, 8, "/lib");
    setenv("SELVEDGE_PLUGINS", path, 1);
}

enum start { STARTED, MISSING, BROKEN };

/* Starts the server; prints the reason when there is none. It is missing only where its program says so. */
static enum start start(void)
{
    static const char program[] = "tests/support/python/servers/postgres_server.py";
    int to[2], from[2];
    char line[1024] = "";
    find_plugin();
    signal(SIGPIPE, SIG_IGN);
    if (access(program, R_OK) != 0 || pipe(to) != 0 || pipe(from) != 0) {
        printf("'%s' is not found from here\n", program);
        return BROKEN;
    }
    server.pid = fork();
    if (server.pid == 0) {
        dup2(to[0], 0);
        dup2(from[1], 1);
        for (int fd = 3; fd < 64; fd++) close(fd);
        execl("/usr/bin/python3", "python3", program, (char *)NULL);
        _exit(127);
    }
    close(to[0]);
    close(from[1]);
    server.to = fdopen(to[1], "w");
    server.from = fdopen(from[0], "r");
    if (server.to == NULL || server.from == NULL || fgets(line, sizeof line, server.from) == NULL) return BROKEN;
    chomp(line);
    if (strncmp(line, "password ", 9) != 0) {
        printf("PostgreSQL left out: %s\n", line);
        return strncmp(line, "missing: ", 9) == 0 ? MISSING : BROKEN;
    }
    snprintf(server.password, sizeof server.password, "%.200s", line + 9);
    return STARTED;
}

static void stop(void)
{
    if (server.to != NULL) fclose(server.to);
    if (server.from != NULL) fclose(server.from);
    if (server.pid > 0) waitpid(server.pid, NULL, 0);
    server.to = server.from = NULL;
    server.pid = 0;
}

static void postgresql_is_missing(void **state)
{
    (void)state;
    skip();
}

static void postgresql_does_not_start(void **state)
{
    (void)state;
    fail_msg("%s", "the PostgreSQL server of the tests does not start");
}

int store_fixture_shared(int (*run)(const char *database))
{
    static const char name[] = "postgresql";
    const struct CMUnitTest none[] = {cmocka_unit_test(postgresql_is_missing)};
    const struct CMUnitTest broken[] = {cmocka_unit_test(postgresql_does_not_start)};
    const enum start started = start();
    int n = started == STARTED   ? run(name)
            : started == MISSING ? cmocka_run_group_tests_name(name, none, NULL, NULL)
                                 : cmocka_run_group_tests_name(name, broken, NULL, NULL);
    stop();
    return n;
}

int store_fixture_each(int (*run)(const char *database))
{
    int n = run("sqlite");
    return n + store_fixture_shared(run);
}

int store_fixture_begin(struct store_fixture *f)
{
    struct error err = {0};
    *f = (struct store_fixture){.folder = "/tmp/selvedge-store-XXXXXX"};
    if (mkdtemp(f->folder) == NULL) return -1;
    snprintf(f->place.address, sizeof f->place.address, "%s/selvedge.db", f->folder);
    if (server.to != NULL) {
        fputs("database\n", server.to);
        fflush(server.to);
        if (fgets(f->place.address, sizeof f->place.address, server.from) == NULL) return -1;
        chomp(f->place.address);
        f->place.password = strdup(server.password);
    }
    if (store_open_place(&f->place, &f->store, &err) == STATUS_OK) return 0;
    printf("%s\n", err.text);
    return -1;
}

void store_fixture_reopen(struct store_fixture *f)
{
    store_close(f->store);
    f->store = NULL;
    store_open_place(&f->place, &f->store, NULL);
}

void store_fixture_end(struct store_fixture *f)
{
    char path[96];
    store_close(f->store);
    store_place_release(&f->place);
    snprintf(path, sizeof path, "%s/selvedge.db", f->folder);
    unlink(path);
    rmdir(f->folder);
}
