#include "optimizer/report/letterhead_file.h"
#include "optimizer/job/job_folder.h"

#include <string.h>

/* True for "data:image/png;base64," or "data:image/svg+xml;base64," and base64 behind it. */
static bool is_logo(const char *text)
{
    static const char *const begin[] = {"data:image/png;base64,", "data:image/svg+xml;base64,"};
    for (size_t i = 0; i < 2 && text != NULL; i++) {
        const size_t n = strlen(begin[i]);
        if (strncmp(text, begin[i], n) == 0)
            return text[n + strspn(text + n, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=")] ==
                   '\0';
    }
    return false;
}

json_t *letterhead_file_read(const struct report *report)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FILE_LETTERHEAD, NULL, path);
    json_t *head = json_load_file(path, 0, NULL);
    if (!json_is_object(head)) {
        json_decref(head);
        return json_object();
    }
    if (!is_logo(json_string_value(json_object_get(head, "logo")))) json_object_del(head, "logo");
    return head;
}
