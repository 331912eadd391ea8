#include "server/doctor/doctor.h"
#include "server/doctor/doctor_report.h"

status doctor_run(const struct settings *settings, const char *worker, const char *job, FILE *out, struct error *err)
{
    struct doctor d = {.settings = settings, .worker = worker, .out = out};
    if (job != NULL) {
        status s = doctor_examine_job(&d, job, err);
        if (s != STATUS_OK) return s;
    } else {
        doctor_examine_machine(&d);
        doctor_examine_service(&d);
        doctor_examine_cluster(&d);
    }
    fprintf(out, "%d ok, %d notes, %d faults\n", d.n[DOCTOR_OK], d.n[DOCTOR_NOTE], d.n[DOCTOR_FAULT]);
    fflush(out);
    if (d.n[DOCTOR_FAULT] == 0) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "the doctor has found faults: %d", d.n[DOCTOR_FAULT]);
}
