#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/report/findings/findings.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { NAMES_BYTES = 200 };

/* Appends a name to a list "a, b"; a text that does not fit is cut. */
static void append_name(char list[NAMES_BYTES], const char *name)
{
    size_t used = strlen(list);
    snprintf(list + used, NAMES_BYTES - used, "%s%s", used > 0 ? ", " : "", name);
}

/* Names of the parameters and numbers of the cloth that the rows do not determine, and names of parameters at a
 * bound. */
static void list_parameters(const struct report *report, const struct pipeline_model *m,
                            char not_determined[NAMES_BYTES], char at_bound[NAMES_BYTES])
{
    const struct uncertainty *u = &m->fit->result.uncertainty, *joint = &m->fit->cloth.joint.uncertainty;
    not_determined[0] = at_bound[0] = '\0';
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++) {
        if (m->setup->parameter[p].fixed) continue;
        if (!u->determined[p]) append_name(not_determined, m->setup->sets.info.param[p].name);
        if (u->at_bound[p]) append_name(at_bound, m->setup->sets.info.param[p].name);
    }
    for (size_t k = 0; k < report->in.made->number.n; k++) {
        const size_t p = joint->n_param - report->in.made->number.n + k;
        if (!joint->determined[p]) append_name(not_determined, report->in.made->number.info[k].name);
        if (joint->at_bound[p]) append_name(at_bound, report->in.made->number.info[k].name);
    }
}

/* The error that judges the fit: over held-out rows; without any, over fitted rows left out in turn; where these are
 * too few, over the fitted rows. If the job gives every photograph a gain, each row has its own. */
static void judge_rows(const struct pipeline_model *m, struct verdict_facts *f)
{
    const struct validation *v = m->validation;
    const bool gains = m->setup->option->gain == JOB_GAIN_PER_PHOTOGRAPH;
    const struct objective_value *held_out = gains ? &v->held_out_with_gains : &v->held_out,
                                 *fitted = gains ? &v->fit_with_gains : &v->fit;
    f->rows = VERDICT_FITTED;
    f->error = fitted->rel_rms;
    f->error_se = fitted->rel_rms_se;
    if (isfinite(held_out->rel_rms)) {
        f->rows = VERDICT_HELD_OUT;
        f->error = held_out->rel_rms;
        f->error_se = held_out->rel_rms_se;
    } else if (m->fit->result.cross_validation.n_fold > 0) {
        f->rows = VERDICT_LEFT_OUT;
        f->error = m->fit->result.cross_validation.rel_rms;
        f->error_se = m->fit->result.cross_validation.rel_rms_se;
    }
}

static bool has_other_solution(const struct pipeline_model *m)
{
    bool elsewhere = false;
    for (size_t k = 0; k < m->fit->result.n_start; k++) elsewhere = elsewhere || m->fit->result.start[k].elsewhere;
    return elsewhere;
}

/* The error of the plain BRDF over the same rows, left out in the same way. */
static double plain_brdf_error(const struct pipeline_skill *skill, enum verdict_rows rows)
{
    const double error[] = {[VERDICT_HELD_OUT] = skill->heldout_rel_rms,
                            [VERDICT_LEFT_OUT] = skill->left_out_rel_rms,
                            [VERDICT_FITTED] = skill->fit_rel_rms};
    return skill->measured ? error[rows] : NAN;
}

static void add_fit(const struct report *report, const struct pipeline_model *m, struct verdict_facts *f)
{
    judge_rows(m, f);
    const enum job_set set = f->rows == VERDICT_HELD_OUT ? JOB_SET_HELD_OUT : JOB_SET_FIT;
    f->has_fit = true;
    f->allowed = verdict_allowed_error(&report->in.job->rows->observation, set);
    f->one_color_error = verdict_one_color_error(&report->in.job->rows->observation, set);
    f->plain_brdf_error = plain_brdf_error(&report->skill, f->rows);
    f->converged = m->fit->result.converged;
    f->derivatives_right = pipeline_certificate_passed(m);
    f->several_solutions = has_other_solution(m);
}

static enum verdict_scan scan_of(const struct report *report)
{
    static const enum verdict_scan of[] = {[GRADE_NONE] = VERDICT_NO_SCAN,
                                           [GRADE_RESOLVED] = VERDICT_SCAN_RESOLVED,
                                           [GRADE_PARTLY] = VERDICT_SCAN_PARTLY,
                                           [GRADE_UNRESOLVED] = VERDICT_SCAN_UNRESOLVED};
    return report->in.job->scan->given ? of[report->in.made->geometry.grade.verdict] : VERDICT_NO_SCAN;
}

void pipeline_reach_verdict(struct report *report)
{
    char not_determined[NAMES_BYTES] = "", at_bound[NAMES_BYTES] = "";
    struct verdict_facts facts = {.scan = scan_of(report),
                                  .scan_safe_share = report->in.made->geometry.grade.safe_share,
                                  .grade = report->in.job->scan->given ? &report->in.made->geometry.grade : NULL,
                                  .n_input_warning = report->in.n_input_warning,
                                  .not_determined = not_determined,
                                  .at_bound = at_bound};
    if (report->in.kind == JOB_OF_FIT) {
        const struct pipeline_model *best = &report->model[report_best_model(report)];
        list_parameters(report, best, not_determined, at_bound);
        add_fit(report, best, &facts);
    } else
        facts.n_input_warning = worker_status_n_warning(report->in.job->tools->status);
    verdict_reach(&facts, &report->verdict);
    log_info(report->in.job->tools->log, "verdict: %s. %s", verdict_code_words(report->verdict.code),
             report->verdict.text);
    worker_status_verdict(report->in.job->tools->status, verdict_json(&report->verdict));
}
