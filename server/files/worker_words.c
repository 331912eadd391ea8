#include "server/files/worker_words.h"
#include "base/catalogue/verdict_code.h"
#include "base/files/file_ledger_json.h"
#include "base/files/json_member.h"

#include <string.h>

#define N(table) (sizeof(table) / sizeof(table)[0])
#define TEXT(name)                                                                                                     \
    {                                                                                                                  \
        name, JSON_IS_TEXT, false, 0, 0                                                                                \
    }
#define NUMBER(name, least, most)                                                                                      \
    {                                                                                                                  \
        name, JSON_IS_NUMBER, true, least, most                                                                        \
    }
#define COUNT(name)                                                                                                    \
    {                                                                                                                  \
        name, JSON_IS_WHOLE, true, 0, MOST_COUNT                                                                       \
    }
#define FINITE(name) NUMBER(name, -1e300, 1e300)
/* Times in seconds, and numbers that are whole as a double too. */
#define MOST_S 1e11
#define MOST_COUNT 9007199254740992.0

static const struct json_member of_status[] = {TEXT("state"),
                                               TEXT("stage"),
                                               TEXT("message"),
                                               COUNT("attempt"),
                                               COUNT("i_stage"),
                                               COUNT("n_stage"),
                                               COUNT("step"),
                                               COUNT("peak_rss_bytes"),
                                               NUMBER("stage_fraction", 0, 1),
                                               NUMBER("fraction", 0, 1),
                                               NUMBER("eta_s", 0, MOST_S),
                                               NUMBER("eta_low_s", 0, MOST_S),
                                               NUMBER("eta_high_s", 0, MOST_S),
                                               NUMBER("heartbeat_unix_s", 0, MOST_S),
                                               NUMBER("started_unix_s", 0, MOST_S),
                                               NUMBER("cpu_s", 0, MOST_S),
                                               FINITE("objective"),
                                               FINITE("objective_se"),
                                               {"warnings", JSON_IS_LIST, false, 0, 0},
                                               {"verdict", JSON_IS_OBJECT, true, 0, 0},
                                               {"error", JSON_IS_OBJECT, true, 0, 0}},
                                of_verdict[] = {TEXT("code"), TEXT("words"), TEXT("text")},
                                of_reasons[] = {{"judged_by", JSON_IS_TEXT, true, 0, 0},
                                                FINITE("rel_rms"),
                                                FINITE("rel_rms_se"),
                                                FINITE("allowed_rel_rms"),
                                                FINITE("one_color_rel_rms"),
                                                FINITE("plain_brdf_rel_rms"),
                                                {"reservations", JSON_IS_LIST, false, 0, 0},
                                                TEXT("code"),
                                                TEXT("words"),
                                                TEXT("text")},
                                of_reservation[] = {TEXT("code"), TEXT("text")},
                                of_plan[] = {COUNT("n_thread"),
                                             NUMBER("wall_s", 0, MOST_S),
                                             NUMBER("wall_low_s", 0, MOST_S),
                                             NUMBER("wall_high_s", 0, MOST_S),
                                             NUMBER("cpu_s", 0, MOST_S),
                                             NUMBER("memory_bytes", 0, MOST_COUNT),
                                             NUMBER("disk_bytes", 0, MOST_COUNT),
                                             {"stages", JSON_IS_LIST, false, 0, 0},
                                             NUMBER("planned_unix_s", 0, MOST_S),
                                             COUNT("attempt"),
                                             {"error", JSON_IS_OBJECT, true, 0, 0}},
                                of_stage[] = {TEXT("name"), NUMBER("wall_s", 0, MOST_S)},
                                of_check[] = {{"faults", JSON_IS_LIST, false, 0, 0},
                                              {"warnings", JSON_IS_LIST, false, 0, 0},
                                              {"files", JSON_IS_LIST, false, 0, 0},
                                              COUNT("n_file")},
                                of_fault[] = {TEXT("code"), {"field", JSON_IS_TEXT, true, 0, 0}, TEXT("detail")},
                                of_warning[] = {TEXT("field"), TEXT("detail")},
                                of_input[] = {
                                    TEXT("name"), TEXT("role"), COUNT("size"), {"sha256", JSON_IS_TEXT, true, 0, 0}};

static bool is_verdict(json_t *verdict)
{
    enum verdict_code code = VERDICT_NONE;
    json_members_keep(verdict, of_reasons, N(of_reasons), true);
    if (!json_members_keep(verdict, of_verdict, N(of_verdict), false)) return false;
    json_items_keep(json_object_get(verdict, "reservations"), of_reservation, N(of_reservation));
    return verdict_code_parse(json_string_value(json_object_get(verdict, "code")), &code) && code != VERDICT_NONE;
}

void worker_words_of_status(json_t *status)
{
    json_members_keep(status, of_status, N(of_status), true);
    json_texts_keep(json_object_get(status, "warnings"));
    if (!is_verdict(json_object_get(status, "verdict"))) json_object_del(status, "verdict");
}

void worker_words_of_plan(json_t *plan)
{
    json_members_keep(plan, of_plan, N(of_plan), true);
    json_items_keep(json_object_get(plan, "stages"), of_stage, N(of_stage));
}

void worker_words_of_check(json_t *report)
{
    json_members_keep(report, of_check, N(of_check), true);
    json_items_keep(json_object_get(report, "faults"), of_fault, N(of_fault));
    json_items_keep(json_object_get(report, "warnings"), of_warning, N(of_warning));
    file_ledgers_keep(json_object_get(report, "files"));
}

void worker_words_of_inputs(json_t *inputs) { json_items_keep(inputs, of_input, N(of_input)); }
