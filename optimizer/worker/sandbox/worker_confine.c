#include "optimizer/worker/sandbox/worker_confine.h"
#include "optimizer/job/job_outline.h"

#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/reading/pipeline_profile_prior.h"
#include "optimizer/stages/scene/pipeline_adopt.h"
#include "optimizer/worker/sandbox/program_process.h"
#include "optimizer/worker/sandbox/sandbox_calls.h"
#include "optimizer/worker/sandbox/sandbox_files.h"

#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* the sanitizers and the coverage of tests write files and trace the process, so their builds have no sandbox */
#ifdef SELVEDGE_NO_SANDBOX
enum { HAS_SANDBOX = 0 };
#else
enum { HAS_SANDBOX = 1 };
#endif

/* Files that every worker reads: libraries, the time zone, and descriptions of the machine for libc, OpenBLAS and the
 * thread pools. */
static const struct sandbox_path usual[] = {
    {SANDBOX_EXECUTE, "/usr"},
    {SANDBOX_EXECUTE, "/lib"},
    {SANDBOX_EXECUTE, "/lib64"},
    {SANDBOX_READ, "/etc/ld.so.cache"},
    {SANDBOX_READ, "/etc/ld.so.preload"},
    {SANDBOX_READ, "/etc/localtime"},
    {SANDBOX_READ, "/proc/self/status"}, /* not the folder, which has the sockets of the machine */
    {SANDBOX_READ, "/proc/self/statm"},
    {SANDBOX_READ, "/proc/self/maps"},
    {SANDBOX_READ, "/proc/self/stat"},
    {SANDBOX_READ, "/proc/cpuinfo"},
    {SANDBOX_READ, "/proc/meminfo"},
    {SANDBOX_READ, "/proc/stat"},
    {SANDBOX_READ, "/proc/sys/vm"},
    {SANDBOX_READ, "/sys/devices/system"},
    {SANDBOX_READ, "/dev/urandom"},
    {SANDBOX_OVERWRITE, "/dev/null"}};
enum { N_USUAL = sizeof usual / sizeof *usual };

struct path_list {
    struct sandbox_path *item;
    size_t n, capacity;
    bool failed;
};

static void permit(struct path_list *l, enum sandbox_right right, const char *path)
{
    if (l->n == l->capacity) {
        size_t more = l->capacity == 0 ? 64 : 2 * l->capacity;
        struct sandbox_path *item = realloc(l->item, more * sizeof *item);
        if (item != NULL) {
            l->item = item;
            l->capacity = more;
        }
    }
    if (l->n < l->capacity) l->item[l->n] = (struct sandbox_path){right, strdup(path)};
    if (l->n < l->capacity && l->item[l->n].path != NULL)
        l->n++;
    else
        l->failed = true;
}

static void path_list_free(struct path_list *l)
{
    for (size_t i = 0; i < l->n; i++) free((char *)(uintptr_t)l->item[i].path);
    free(l->item);
}

/* Libraries may come from other folders than the system's. */
static int permit_library(struct dl_phdr_info *info, size_t n, void *context)
{
    (void)n;
    if (info->dlpi_name != NULL && info->dlpi_name[0] == '/') permit(context, SANDBOX_EXECUTE, info->dlpi_name);
    return 0;
}

/* In a folder made by hand an input may be a link to a file elsewhere. */
static void permit_links(const struct job_outline *outline, const char *folder, struct path_list *list)
{
    struct stat st;
    char path[WORKER_PATH_BYTES];
    for (size_t i = 0; i < outline->n_file; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, outline->file[i].name);
        if (lstat(path, &st) == 0 && S_ISLNK(st.st_mode)) permit(list, SANDBOX_READ, path);
    }
}

/* Returns false where the document cannot be read: the worker in its sandbox finds the fault again and reports it. The
 * outline is then empty. */
static bool read_outline(const char *path, struct job_outline *outline)
{
    char *text = NULL;
    size_t n = 0;
    *outline = (struct job_outline){.n_file = 0};
    bool read = file_read_all(path, JOB_MAX_DOCUMENT_BYTES, &text, &n, NULL) == STATUS_OK &&
                job_outline_read(text, n, outline, NULL) == STATUS_OK;
    free(text);
    return read;
}

static void prepare(const struct worker_folder *folder, const struct job_outline *outline, struct confinement *c)
{
    program_processes_start(folder, outline, &c->helper);
    pipeline_link_geometry(folder, outline->geometry_job);
    pipeline_copy_profile(folder, outline->profile_job);
}

static bool by_hand(const struct worker_folder *folder)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(folder, JOB_FILE_ATTEMPT, NULL, path);
    return access(path, F_OK) != 0;
}

/* A file of speeds is overwritten in place, because the folder that holds it is out of reach. */
static void permit_speeds(struct path_list *l, const char *speeds)
{
    int fd = open(speeds, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (fd >= 0) close(fd);
    permit(l, SANDBOX_OVERWRITE, speeds);
}

static void list_files(const struct confine_files *files, const char *program, struct path_list *list,
                       struct confinement *c)
{
    struct worker_folder folder = {.lock_fd = -1};
    char document[WORKER_PATH_BYTES], input[WORKER_PATH_BYTES];
    snprintf(folder.path, sizeof folder.path, "%s", files->folder);
    worker_folder_path(&folder, JOB_FILE_DOCUMENT, NULL, document);
    worker_folder_path(&folder, JOB_FOLDER_INPUT, NULL, input);
    for (size_t i = 0; i < N_USUAL; i++) permit(list, usual[i].right, usual[i].path);
    permit(list, SANDBOX_EXECUTE, program);
    dl_iterate_phdr(permit_library, list);
    if (files->none) return;
    struct job_outline outline;
    const bool read = read_outline(files->document != NULL ? files->document : document, &outline);
    permit(list, files->document != NULL ? SANDBOX_READ : SANDBOX_OWN, files->folder);
    if (files->document != NULL) permit(list, SANDBOX_READ, files->document);
    if (files->speeds != NULL && files->document == NULL) permit_speeds(list, files->speeds);
    if (files->speeds != NULL && files->document != NULL && access(files->speeds, F_OK) == 0)
        permit(list, SANDBOX_READ, files->speeds); /* a plan changes nothing */
    if (!files->no_links && by_hand(&folder))
        permit_links(&outline, files->document != NULL ? files->folder : input, list);
    if (files->document == NULL) c->helper = program_helpers_none();
    if (files->document == NULL && read) prepare(&folder, &outline, c);
    job_outline_release(&outline);
}

/* A daemon that runs as root owns its jobs' folders, so its workers need no right to pass over modes of files. By hand
 * root may run the job of another user. */
static bool owns_everything(const struct confine_files *files)
{
    struct worker_folder folder = {.lock_fd = -1};
    struct stat st;
    snprintf(folder.path, sizeof folder.path, "%s", files->folder);
    if (files->none) return true;
    return files->document == NULL && !by_hand(&folder) && stat(files->folder, &st) == 0 && st.st_uid == geteuid();
}

static status execute_again(const char *program, char **argv, const struct confinement *c, struct error *err)
{
    size_t n = 0;
    char state[80];
    while (argv[n] != NULL) n++;
    char **again = calloc(n + 3, sizeof *again);
    if (again == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start in the sandbox: out of memory");
    const struct program_helper *pdf = &c->helper.pdf, *blend = &c->helper.blend;
    snprintf(state, sizeof state, "%d,%d,%d,%d,%d", c->files_version, (int)pdf->pid, pdf->order_fd, (int)blend->pid,
             blend->order_fd);
    again[0] = argv[0];
    again[1] = (char *)(uintptr_t) "--confined";
    again[2] = state;
    memcpy(again + 3, argv + 1, (n - 1) * sizeof *again);
    execv(program, again);
    free(again);
    return error_set_errno(err, "cannot execute '%s' again in its sandbox", program);
}

status worker_confine(const struct confine_files *files, char **argv, struct error *err)
{
    char program[WORKER_PATH_BYTES];
    struct path_list list = {0};
    struct confinement c = {.helper = program_helpers_none()};
    ssize_t n = readlink("/proc/self/exe", program, sizeof program - 1);
    if (n <= 0) return error_set_errno(err, "cannot find this program");
    program[n] = '\0';
    list_files(files, program, &list, &c);
    status s = STATUS_OK;
    if (list.failed) s = error_set(err, STATUS_NO_MEMORY, "cannot make a sandbox: out of memory");
    if (s == STATUS_OK && HAS_SANDBOX) s = sandbox_files_restrict(list.item, list.n, &c.files_version, err);
    path_list_free(&list);
    if (s == STATUS_OK && HAS_SANDBOX && owns_everything(files)) sandbox_files_drop_capabilities();
    return s == STATUS_OK ? execute_again(program, argv, &c, err) : s;
}

void worker_prepare(const char *folder_path, struct confinement *c)
{
    struct worker_folder folder = {.lock_fd = -1};
    char document[WORKER_PATH_BYTES];
    snprintf(folder.path, sizeof folder.path, "%s", folder_path);
    worker_folder_path(&folder, JOB_FILE_DOCUMENT, NULL, document);
    struct job_outline outline;
    c->helper = program_helpers_none();
    if (read_outline(document, &outline)) prepare(&folder, &outline, c);
    job_outline_release(&outline);
}

bool confine_mode_parse(const char *text, enum confine_mode *mode)
{
    static const char *const name[] = {[CONFINE_OFF] = "off", [CONFINE_AUTO] = "auto", [CONFINE_REQUIRED] = "required"};
    for (size_t i = 0; i < sizeof name / sizeof *name; i++)
        if (strcmp(text, name[i]) == 0) {
            *mode = (enum confine_mode)i;
            return true;
        }
    return false;
}

bool confinement_parse(const char *state, struct confinement *c)
{
    int pid[2];
    *c = (struct confinement){.executed = true};
    struct program_helper *pdf = &c->helper.pdf, *blend = &c->helper.blend;
    if (sscanf(state, "%d,%d,%d,%d,%d", &c->files_version, &pid[0], &pdf->order_fd, &pid[1], &blend->order_fd) != 5)
        return false;
    pdf->pid = pid[0];
    blend->pid = pid[1];
    if (pdf->order_fd >= 0) fcntl(pdf->order_fd, F_SETFD, FD_CLOEXEC);
    if (blend->order_fd >= 0) fcntl(blend->order_fd, F_SETFD, FD_CLOEXEC);
    return true;
}

status confinement_complete(struct confinement *c, enum confine_mode mode, struct error *err)
{
    char text[200];
    status s = STATUS_OK;
    if (mode != CONFINE_OFF && HAS_SANDBOX) s = sandbox_calls_of_worker(&c->calls, err);
    if (mode != CONFINE_REQUIRED || s != STATUS_OK) return s;
    return confinement_describe(c, mode, text, sizeof text)
               ? STATUS_OK
               : error_set(err, STATUS_UNSUPPORTED, "the settings require a sandbox, but %s", text);
}

bool confinement_describe(const struct confinement *c, enum confine_mode mode, char *text, size_t n_bytes)
{
    if (mode == CONFINE_OFF || !HAS_SANDBOX)
        snprintf(text, n_bytes, "the worker runs without a sandbox%s", HAS_SANDBOX ? "" : ", which this build lacks");
    else if (c->files_version > 0 && c->calls)
        snprintf(text, n_bytes, "the worker runs in a sandbox (Landlock %d, seccomp)", c->files_version);
    else
        snprintf(text, n_bytes, "this machine's kernel lacks %s, so the worker's sandbox restricts %s",
                 c->calls               ? "Landlock"
                 : c->files_version > 0 ? "seccomp"
                                        : "Landlock and seccomp",
                 c->calls               ? "system calls, but no files"
                 : c->files_version > 0 ? "files, but no system calls"
                                        : "nothing");
    return mode == CONFINE_OFF || !HAS_SANDBOX || (c->files_version > 0 && c->calls);
}
