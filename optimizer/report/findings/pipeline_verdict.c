#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/report/findings/findings.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { NAMES_BYTES = 200, REST_BYTES = 24 };

/* Names as a list "a, b and 3 more". */
struct name_list {
    char text[NAMES_BYTES];
    size_t n, n_shown;
};

static void append_name(struct name_list *l, const char *name)
{
    const size_t used = strlen(l->text);
    if (l->n_shown == l->n && used + strlen(name) + REST_BYTES < sizeof l->text) {
        snprintf(l->text + used, sizeof l->text - used, "%s%s", used > 0 ? ", " : "", name);
        l->n_shown++;
    }
    l->n++;
}

static void end_names(struct name_list *l)
{
    const size_t used = strlen(l->text);
    if (l->n > l->n_shown) snprintf(l->text + used, sizeof l->text - used, " and %zu more", l->n - l->n_shown);
}

/* Names of parameters and of numbers of the cloth. */
struct weak_parameters {
    struct name_list not_determined, at_bound, either;
};

static void add_parameter(struct weak_parameters *w, const char *name, const struct uncertainty *u, size_t p)
{
    if (!u->determined[p]) append_name(&w->not_determined, name);
    if (u->at_bound[p]) append_name(&w->at_bound, name);
    if (!u->determined[p] || u->at_bound[p]) append_name(&w->either, name);
}

static void list_parameters(const struct report *report, const struct pipeline_model *m, struct weak_parameters *w)
{
    const struct uncertainty *u = &m->fit->result.uncertainty, *joint = &m->fit->cloth.joint.uncertainty;
    const size_t n_number = report->in.kind == JOB_OF_FIT ? report->in.made->number.n : 0;
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++)
        if (!m->setup->parameter[p].fixed) add_parameter(w, m->setup->sets.info.param[p].name, u, p);
    for (size_t k = 0; k < n_number; k++)
        add_parameter(w, report->in.made->number.info[k].name, joint, joint->n_param - n_number + k);
    end_names(&w->not_determined);
    end_names(&w->at_bound);
    end_names(&w->either);
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
    f->allowed = verdict_allowed_error(&report->in.job->rows->observation, set);
    f->one_color_error = verdict_one_color_error(&report->in.job->rows->observation, set);
    f->plain_brdf_error = plain_brdf_error(&report->skill, f->rows);
    f->converged = m->fit->result.converged;
    f->derivatives_right = pipeline_certificate_passed(m);
    f->several_solutions = has_other_solution(m);
}

/* A profile has no held-out values: its residual over all of them is judged. */
static void add_profile(const struct pipeline_model *m, struct verdict_facts *f)
{
    const struct profile_fit *p = &m->fit->profile;
    f->rows = VERDICT_FITTED;
    f->error = p->rel_rms;
    f->error_se = f->one_color_error = f->plain_brdf_error = NAN;
    f->allowed = hypot(p->stated_rms, VERDICT_LEAST_ERROR);
    f->stated_multiple = sqrt(p->chi_square);
    f->converged = p->converged;
    f->derivatives_right = true;
}

static enum verdict_scan scan_of(const struct report *report)
{
    static const enum verdict_scan of[] = {[GRADE_NONE] = VERDICT_NO_SCAN,
                                           [GRADE_RESOLVED] = VERDICT_SCAN_RESOLVED,
                                           [GRADE_PARTLY] = VERDICT_SCAN_PARTLY,
                                           [GRADE_UNRESOLVED] = VERDICT_SCAN_UNRESOLVED};
    return report->in.job->scan->given ? of[report->in.made->geometry.grade.verdict] : VERDICT_NO_SCAN;
}

static void add_geometry(const struct report *report, struct verdict_facts *f)
{
    f->scan = scan_of(report);
    f->scan_safe_share = report->in.made->geometry.grade.safe_share;
    f->grade = report->in.job->scan->given ? &report->in.made->geometry.grade : NULL;
}

/* The model that the verdict is about; NULL without a fit. */
static const struct pipeline_model *judged_model(const struct report *report)
{
    const bool fitted = report->in.kind == JOB_OF_FIT || report->in.kind == JOB_OF_PROFILE;
    return fitted ? &report->model[report_best_model(report)] : NULL;
}

void pipeline_reach_verdict(struct report *report)
{
    static const enum verdict_kind kind[] = {[JOB_OF_FIT] = VERDICT_OF_FIT,
                                             [JOB_OF_PROFILE] = VERDICT_OF_PROFILE,
                                             [JOB_OF_GEOMETRY] = VERDICT_OF_GEOMETRY,
                                             [JOB_OF_PICTURES] = VERDICT_OF_PICTURES};
    struct weak_parameters weak = {0};
    struct verdict_facts facts = {.kind = kind[report->in.kind],
                                  .not_determined = weak.not_determined.text,
                                  .at_bound = weak.at_bound.text,
                                  .undetermined = weak.either.text,
                                  .stated_multiple = NAN,
                                  .n_input_warning = report->in.n_input_warning};
    const struct pipeline_model *judged = judged_model(report);
    if (judged != NULL) list_parameters(report, judged, &weak);
    facts.n_undetermined = weak.either.n;
    if (report->in.kind == JOB_OF_FIT) add_fit(report, judged, &facts);
    if (report->in.kind == JOB_OF_PROFILE)
        add_profile(judged, &facts);
    else
        add_geometry(report, &facts);
    if (judged == NULL) facts.n_input_warning = worker_status_n_warning(report->in.job->tools->status);
    verdict_reach(&facts, &report->verdict);
    log_info(report->in.job->tools->log, "verdict: %s. %s", report->verdict.words, report->verdict.text);
    worker_status_verdict(report->in.job->tools->status, verdict_json(&report->verdict));
}
