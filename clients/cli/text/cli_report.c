#include "clients/cli/text/cli_report.h"
#include "base/files/file_ledger_json.h"
#include "base/percent_words.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const char *member_text(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text == NULL ? "" : text;
}

static double member_number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

static long member_count(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_integer(value) ? (long)json_integer_value(value) : -1;
}

void report_view(const json_t *job, struct job_view *view)
{
    *view = (struct job_view){.state = ""};
    text_clean(member_text(job, "state"), view->state, sizeof view->state);
    if (strcmp(view->state, "running") == 0) text_clean(member_text(job, "stage"), view->stage, sizeof view->stage);
    text_clean(member_text(job, "message"), view->message, sizeof view->message);
    view->fraction = member_number(job, "fraction");
    view->eta_s = member_number(job, "eta_s");
    view->eta_low_s = member_number(job, "eta_low_s");
    view->eta_high_s = member_number(job, "eta_high_s");
    view->objective = member_number(job, "objective");
    view->objective_se = member_number(job, "objective_se");
    view->step = member_count(job, "step");
    view->i_stage = member_count(job, "i_stage");
    view->n_stage = member_count(job, "n_stage");
}

static void print_time(const json_t *job, const char *key, const char *label, FILE *out)
{
    double t = member_number(job, key);
    if (!(t > 0.0)) return;
    time_t seconds = (time_t)t;
    struct tm local;
    char text[64];
    if (localtime_r(&seconds, &local) == NULL || strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S %Z", &local) == 0)
        return;
    fprintf(out, "%-12s %s\n", label, text);
}

static void print_text(const char *label, const char *text, FILE *out)
{
    char clean[700];
    if (text[0] == '\0') return;
    text_clean(text, clean, sizeof clean);
    fprintf(out, "%-12s %s\n", label, clean);
}

static void print_files(const json_t *job, FILE *out)
{
    size_t i, n_complete = 0;
    const json_t *file, *files = json_object_get(job, "files"), *missing = json_object_get(job, "missing_files");
    json_array_foreach(files, i, file) n_complete += strcmp(member_text(file, "state"), "complete") == 0;
    if (json_array_size(files) > 0)
        fprintf(out, "%-12s %zu of %zu uploaded\n", "files", n_complete, json_array_size(files));
    for (i = 0; i < json_array_size(missing) && i < 5; i++)
        print_text(i == 0 ? "missing" : "", json_string_value(json_array_get(missing, i)), out);
    if (json_array_size(missing) > 5) fprintf(out, "%-12s and %zu more\n", "", json_array_size(missing) - 5);
}

void report_job(const json_t *job, FILE *out)
{
    struct job_view view;
    char line[512];
    size_t i;
    const json_t *value, *error = json_object_get(job, "error");
    report_view(job, &view);
    print_text("job", member_text(job, "id"), out);
    print_text("sample", member_text(job, "sample"), out);
    print_text("state", view.state, out);
    if (strcmp(view.state, "running") == 0) {
        text_progress_plain(&view, line, sizeof line);
        print_text("progress", line, out);
    }
    print_text("message", view.message, out);
    print_time(job, "created_unix_s", "created", out);
    print_time(job, "started_unix_s", "started", out);
    print_time(job, "finished_unix_s", "finished", out);
    if (member_count(job, "attempt") > 1) fprintf(out, "%-12s %ld\n", "attempt", member_count(job, "attempt"));
    print_files(job, out);
    json_array_foreach(json_object_get(job, "warnings"), i, value) if (json_is_string(value))
        print_text("warning", json_string_value(value), out);
    if (json_is_object(error)) {
        snprintf(line, sizeof line, "%s%s%s", member_text(error, "field"),
                 member_text(error, "field")[0] == '\0' ? "" : ": ", member_text(error, "text"));
        print_text("error", line, out);
    }
    report_result(job, out);
}

/* Prints remarks that qualify the number. */
static void print_flags(const json_t *parameter, FILE *out)
{
    const json_t *at_bound = json_object_get(parameter, "at_bound");
    if (json_is_true(json_object_get(parameter, "fixed"))) {
        fputs("fixed  ", out);
        return;
    }
    if (json_is_string(json_object_get(parameter, "tied_to")))
        fprintf(out, "tied to %s  ", member_text(parameter, "tied_to"));
    if (json_is_object(json_object_get(parameter, "prior"))) fputs("with a prior  ", out);
    if (json_is_string(at_bound))
        fprintf(out, "at %s bound  ", strcmp(json_string_value(at_bound), "lower") == 0 ? "lower" : "upper");
    if (json_is_true(at_bound)) fputs("at a bound  ", out);
    if (json_is_false(json_object_get(parameter, "determined"))) fputs("not determined  ", out);
}

/* Returns the name of a parameter without its set: "C_R.r" for "warp.C_R.r". */
static const char *own_name(const json_t *parameter)
{
    const char *name = member_text(parameter, "name"), *set = member_text(parameter, "set");
    size_t n = strlen(set);
    return n > 0 && strncmp(name, set, n) == 0 && name[n] == '.' ? name + n + 1 : name;
}

/* meaning: "" where the line before says it. */
static void print_parameter(const json_t *parameter, const char *meaning, FILE *out)
{
    char name[64], unit[24], value[CLI_SHORT_TEXT], clean[300];
    text_clean(meaning, clean, sizeof clean);
    text_clean(own_name(parameter), name, sizeof name);
    text_clean(member_text(parameter, "unit"), unit, sizeof unit);
    text_with_error(member_number(parameter, "value"), member_number(parameter, "standard_error"), value);
    fprintf(out, "  %-18s %-24s %-5s", name, value, unit);
    print_flags(parameter, out);
    fprintf(out, "%s\n", clean);
}

/* Prints the parameters set by set, each under the name of its group of fibers when there are several. */
static void print_parameters(const json_t *parameters, FILE *out)
{
    const char *before = "", *meaning_before = "";
    size_t i;
    const json_t *parameter;
    if (json_array_size(parameters) > 0) fprintf(out, "fitted parameters (value +- standard error)\n");
    json_array_foreach(parameters, i, parameter)
    {
        const char *set = member_text(parameter, "set");
        char heading[64];
        text_clean(set, heading, sizeof heading);
        if (strcmp(set, before) != 0) fprintf(out, " %s\n", heading);
        before = set;
        const char *meaning = member_text(parameter, "meaning"); /* one for the three channels of a color */
        print_parameter(parameter, strcmp(meaning, meaning_before) == 0 ? "" : meaning, out);
        meaning_before = meaning;
    }
}

/* Writes an error with its standard error (base/percent_words.h). */
static void percent(const json_t *of, const char *key, char text[PERCENT_WORDS_BYTES])
{
    char key_se[64];
    snprintf(key_se, sizeof key_se, "%s_se", key);
    percent_words(member_number(of, key), member_number(of, key_se), text);
}

/* Prints one line for each model if there are several. */
static void print_models(const json_t *models, const char *chosen_by, FILE *out)
{
    size_t i;
    const json_t *m;
    if (json_array_size(models) < 2) return;
    const bool gains = !isnan(member_number(json_array_get(models, 0), "fit_rel_rms_with_gains"));
    fprintf(out, "%-24s %16s %16s %16s %12s %8s\n", "model (rel. RMS error)", "fitted", "rows left out", "held out",
            "paths", "time");
    json_array_foreach(models, i, m)
    {
        char id[64], fitted[PERCENT_WORDS_BYTES], left_out[PERCENT_WORDS_BYTES], held_out[PERCENT_WORDS_BYTES];
        char time[CLI_SHORT_TEXT];
        text_clean(member_text(m, "id"), id, sizeof id);
        percent(m, gains ? "fit_rel_rms_with_gains" : "fit_rel_rms", fitted);
        percent(m, gains ? "heldout_rel_rms_with_gains" : "heldout_rel_rms", held_out);
        percent(json_object_get(m, "cross_validation"), "rel_rms", left_out);
        text_duration(member_number(m, "fit_wall_s"), time);
        fprintf(out, "  %-22s %16s %16s %16s %12.3g %8s  %s%s\n", id, fitted, left_out, held_out,
                member_number(m, "n_path_fit"), time, json_is_true(json_object_get(m, "best")) ? "best " : "",
                json_is_false(json_object_get(m, "converged")) ? "not converged" : "");
    }
    fprintf(out, "%sof the best model%s:\n", gains ? "(errors: each photograph with its own gain)\n" : "",
            strcmp(chosen_by, "cross_validation") == 0 ? ", chosen by fitted rows left out one after another" : "");
}

static void print_radius(const json_t *radius, FILE *out)
{
    char value[CLI_SHORT_TEXT];
    if (!json_is_object(radius)) return;
    text_with_error(member_number(radius, "radius_um"), member_number(radius, "standard_error_um"), value);
    fprintf(out, "fiber radius: %s um (start %.4g um)%s%s\n", value, member_number(radius, "start_um"),
            json_is_false(json_object_get(radius, "determined")) ? "  not determined" : "",
            json_is_true(json_object_get(radius, "at_bound")) ? "  at the edge of its range" : "");
}

/* Prints the description of a trial's phantom. */
static void print_trial_fibers(const json_t *trial, FILE *out)
{
    const double ratio = member_number(trial, "axis_ratio"), lumen = member_number(trial, "lumen");
    fprintf(out, "phantom of these fibers: radii spread by %.1f %%", 100.0 * member_number(trial, "radius_spread"));
    if (ratio > 1.0) fprintf(out, ", ratios of axes %.2f +- %.2f", ratio, member_number(trial, "axis_ratio_spread"));
    if (lumen > 0.0) fprintf(out, ", lumens %.2f +- %.2f of the width", lumen, member_number(trial, "lumen_spread"));
    fputs(ratio > 1.0 || lumen > 0.0 ? "\n" : ", solid discs\n", out);
}

/* The geometry of a job without a fit. */
static void print_geometry(const json_t *g, FILE *out)
{
    const json_t *grade = json_object_get(g, "grade");
    fprintf(out, "fibers: %.0f, %.4g mm in all, mean radius %.4g um\n", member_number(g, "n_fiber"),
            member_number(g, "total_length_mm"), member_number(g, "mean_radius_um"));
    if (json_is_object(grade))
        fprintf(out, "single fibers in the scan: %s, %.0f %% of their length is sure\n", member_text(grade, "verdict"),
                100.0 * member_number(grade, "safe_share"));
    const json_t *trial = json_object_get(g, "trial");
    if (json_is_object(trial)) {
        print_trial_fibers(trial, out);
        fprintf(
            out,
            "what this scan can give: %.1f %% of the length, axes to %.2f voxels, %.2f pieces a fiber, %.3f merges, "
            "radii to %.1f %%\n",
            100.0 * member_number(trial, "recall"), member_number(trial, "axis_rms_voxel"),
            member_number(trial, "fragments"), member_number(trial, "merges"),
            100.0 * member_number(trial, "radius_rms"));
    }
}

/* The residuals of models that were fitted to the profile of a fiber. */
static void print_profile(const json_t *profile, FILE *out)
{
    size_t i;
    const json_t *m;
    fprintf(out, "%-24s %10s %10s %14s %8s\n", "model (residual)", "of range", "relative", "scale", "time");
    json_array_foreach(json_object_get(profile, "models"), i, m)
    {
        char id[64], range[PERCENT_WORDS_BYTES], relative[PERCENT_WORDS_BYTES], time[CLI_SHORT_TEXT];
        text_clean(member_text(m, "id"), id, sizeof id);
        percent(m, "nrmse", range);
        percent(m, "rel_rms", relative);
        text_duration(member_number(m, "fit_wall_s"), time);
        fprintf(out, "  %-22s %10s %10s %14.5g %8s  %s%s\n", id, range, relative, member_number(m, "scale"), time,
                json_is_true(json_object_get(m, "best")) ? "best " : "",
                json_is_false(json_object_get(m, "converged")) ? "not converged" : "");
        if (json_is_number(json_object_get(m, "turn_deg")))
            fprintf(out, "    section turned by %.4g degrees, error %.2g%s\n", member_number(m, "turn_deg"),
                    member_number(m, "turn_se_deg"),
                    json_is_false(json_object_get(m, "turn_determined")) ? ": not determined" : "");
    }
}

static void report_verdict(const json_t *verdict, FILE *out)
{
    size_t i;
    const json_t *reservation;
    if (!json_is_object(verdict)) return;
    print_text("verdict", member_text(verdict, "words"), out);
    print_text("", member_text(verdict, "text"), out);
    json_array_foreach(json_object_get(verdict, "reservations"), i, reservation)
        print_text("  -", member_text(reservation, "text"), out);
}

/* How far the cloth of each export is from the job's own renderings. */
static void print_exports(const json_t *exports, FILE *out)
{
    size_t i, k;
    const json_t *export, *warning;
    if (json_array_size(exports) > 0) fprintf(out, "files for other programs (difference from the job's renderings)\n");
    json_array_foreach(exports, i, export)
    {
        char folder[64], error[PERCENT_WORDS_BYTES];
        text_clean(member_text(export, "folder"), folder, sizeof folder);
        percent(export, "row_rel_rms", error);
        fprintf(out, "  %-18s %-16s%s\n", folder, error,
                json_is_true(json_object_get(export, "exact")) ? "  exact.xml shows the fitted scattering itself" : "");
        json_array_foreach(json_object_get(export, "warnings"), k, warning) if (json_is_string(warning))
            print_text("    warning", json_string_value(warning), out);
    }
}

void report_result(const json_t *job, FILE *out)
{
    static const struct {
        const char *key, *label;
    } residual[] = {{"fit_rel_rms", "relative RMS error, fitted"}, {"heldout_rel_rms", "relative RMS error, held out"}};
    size_t i;
    const json_t *parameter, *parameters = json_object_get(job, "parameters"), *result = json_object_get(job, "result");
    const json_t *models = json_object_get(result, "models");
    report_verdict(json_object_get(job, "verdict"), out);
    if (json_is_object(json_object_get(result, "profile"))) {
        print_profile(json_object_get(result, "profile"), out);
        print_parameters(parameters, out);
        return;
    }
    if (json_is_array(models) && json_array_size(models) == 0) { /* of geometry only */
        print_geometry(json_object_get(result, "geometry"), out);
        return;
    }
    print_models(models, member_text(result, "chosen_by"), out);
    print_radius(json_object_get(result, "radius"), out);
    print_parameters(parameters, out);
    for (i = 0; i < sizeof residual / sizeof residual[0]; i++) {
        char text[PERCENT_WORDS_BYTES];
        percent(result, residual[i].key, text);
        if (strcmp(text, "-") != 0) fprintf(out, "%s: %s\n", residual[i].label, text);
    }
    if (json_is_object(json_object_get(result, "cross_validation"))) {
        char text[PERCENT_WORDS_BYTES];
        percent(json_object_get(result, "cross_validation"), "rel_rms", text);
        fprintf(out, "relative RMS error, fitted rows left out one after another: %s\n", text);
    }
    json_array_foreach(json_object_get(result, "nuisance"), i, parameter) print_parameter(parameter, "", out);
    print_exports(json_object_get(result, "exports"), out);
    const json_t *converged = json_object_get(result, "converged");
    if (json_is_false(converged)) fprintf(out, "The fit has NOT converged; see the log.\n");
}

/* The verdict in a column of the list. */
static const char *verdict_word(const json_t *job)
{
    const char *code = member_text(json_object_get(job, "verdict"), "code");
    return strcmp(code, "does_not_describe_this_cloth") == 0 ? "does not describe"
           : strcmp(code, "good_but_undetermined") == 0      ? "good, undetermined"
           : strcmp(code, "pictures_only") == 0              ? "pictures only"
                                                             : code;
}

const char *const report_list_head[] = {"id", "*state", "*verdict", ">done", ">ETA", "sample", NULL};

void report_list_add(const json_t *job, struct text_table *table)
{
    struct job_view view;
    char done[16], eta[CLI_SHORT_TEXT];
    report_view(job, &view);
    text_duration(view.eta_s, eta);
    snprintf(done, sizeof done, "%.0f %%", isnan(view.fraction) ? 0.0 : 100.0 * view.fraction);
    text_table_add(table, (const char *const[]){member_text(job, "id"), view.state, verdict_word(job), done, eta,
                                                member_text(job, "sample")});
}

size_t cli_print_faults(const json_t *list, const char *label, FILE *out)
{
    size_t i;
    const json_t *item;
    json_array_foreach(list, i, item)
    {
        char field[160], detail[700];
        const char *f = json_string_value(json_object_get(item, "field")),
                   *d = json_string_value(json_object_get(item, "detail"));
        text_clean(f != NULL ? f : "", field, sizeof field);
        text_clean(d != NULL ? d : "", detail, sizeof detail);
        bool named = field[0] == '\0' || strstr(detail, field) != NULL;
        text_put_word(label, text_colored(out), out);
        fprintf(out, ": %s%s%s\n", named ? "" : field, named ? "" : ": ", detail);
    }
    return json_array_size(list);
}

void cli_print_statements(const json_t *files, FILE *out)
{
    size_t i;
    json_t *sentence, *list = file_ledger_sentences(files);
    json_array_foreach(list, i, sentence)
    {
        char text[700];
        text_clean(json_string_value(sentence), text, sizeof text);
        fprintf(out, "%s\n", text);
    }
    json_decref(list);
}
