#include "optimizer/job/checks/job_consistency.h"
#include "base/catalogue/volume_format.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_sections.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* ---- angles ---- */

void angle_span_add(struct angle_span *span, double light_theta, double light_phi, double camera_theta,
                    double camera_phi, double rotation)
{
    span->n_view++;
    span->theta = fmax(span->theta, fmax(fabs(light_theta), fabs(camera_theta)));
    span->phi = fmax(span->phi, fmax(fmax(fabs(light_phi), fabs(camera_phi)), fabs(rotation)));
}

bool angle_span_in_radians(const struct angle_span *span)
{
    return span->n_view > 1 && span->theta >= 0.2 && span->theta < JOB_RADIANS_THETA && span->phi < JOB_RADIANS_PHI;
}

/* ---- kinds of files by the ending of their names ---- */

enum file_kind {
    KIND_UNKNOWN,
    KIND_PICTURE,
    KIND_TIFF,
    KIND_VOLUME,
    KIND_FIBERS,
    KIND_TABLE,
    KIND_JSON,
    KIND_MESH,
    KIND_DRAFT,
    KIND_OTHER
};

static enum file_kind kind_of(const char *name)
{
    static const struct {
        const char *ending;
        enum file_kind kind;
    } known[] = {{".exr", KIND_PICTURE},  {".png", KIND_PICTURE}, {".jpg", KIND_PICTURE}, {".jpeg", KIND_PICTURE},
                 {".dng", KIND_PICTURE},  {".cr2", KIND_PICTURE}, {".cr3", KIND_PICTURE}, {".nef", KIND_PICTURE},
                 {".arw", KIND_PICTURE},  {".raf", KIND_PICTURE}, {".orf", KIND_PICTURE}, {".rw2", KIND_PICTURE},
                 {".tif", KIND_TIFF},     {".tiff", KIND_TIFF},   {".hair", KIND_FIBERS}, {".csv", KIND_TABLE},
                 {".binary", KIND_TABLE}, {".bsdf", KIND_TABLE},  {".astm", KIND_TABLE},  {".pdf", KIND_OTHER},
                 {".doc", KIND_OTHER},    {".docx", KIND_OTHER},  {".xls", KIND_OTHER},   {".xlsx", KIND_OTHER},
                 {".ods", KIND_OTHER},    {".zip", KIND_OTHER},   {".gz", KIND_OTHER},    {".7z", KIND_OTHER},
                 {".json", KIND_JSON},    {".html", KIND_OTHER},  {".heic", KIND_OTHER},  {".gif", KIND_OTHER},
                 {".bmp", KIND_OTHER},    {".webp", KIND_OTHER},  {".mp4", KIND_OTHER},   {".dcm", KIND_OTHER},
                 {".hdf5", KIND_OTHER},   {".h5", KIND_OTHER},    {".npy", KIND_OTHER},   {".mat", KIND_OTHER},
                 {".psd", KIND_OTHER},    {".obj", KIND_MESH},    {".ply", KIND_OTHER},   {".stl", KIND_OTHER},
                 {".fbx", KIND_OTHER},    {".wif", KIND_DRAFT}};
    const char *dot = strrchr(name, '.');
    enum file_kind kind = KIND_UNKNOWN;
    for (size_t i = 0; dot != NULL && i < sizeof known / sizeof known[0]; i++)
        if (strcasecmp(dot, known[i].ending) == 0) kind = known[i].kind;
    const bool unknown = kind == KIND_UNKNOWN || kind == KIND_OTHER;
    return unknown && volume_format_of(name) != NULL ? KIND_VOLUME : kind;
}

struct role_rule {
    const char *role, *wanted;
    bool kind[KIND_OTHER + 1]; /* allowed; an unknown ending is allowed everywhere, because the content decides */
};

#define ANY_PHOTOGRAPH [KIND_UNKNOWN] = true, [KIND_PICTURE] = true, [KIND_TIFF] = true
static const struct role_rule role_rule[] = {
    {"volume",
     "a scan: "
#define VOLUME_FORMAT(reader, shown, ...) shown ", "
#include "generated/volume_formats.def"
#undef VOLUME_FORMAT
     "or raw samples",
     {[KIND_UNKNOWN] = true, [KIND_TIFF] = true, [KIND_VOLUME] = true}},
    {"fibers", "fibers: .hair or .txt", {[KIND_UNKNOWN] = true, [KIND_FIBERS] = true}},
    {"measurements", "a table: .csv, or a file of a goniophotometer", {[KIND_UNKNOWN] = true, [KIND_TABLE] = true}},
    {"environment", "an image of the surroundings: .exr", {[KIND_UNKNOWN] = true, [KIND_PICTURE] = true}},
    {"photograph", "a photograph: OpenEXR, TIFF, camera raw, PNG or JPEG", {ANY_PHOTOGRAPH}},
    {"chart", "a photograph: OpenEXR, TIFF, camera raw, PNG or JPEG", {ANY_PHOTOGRAPH}},
    {"white_reference", "a photograph: OpenEXR, TIFF, camera raw, PNG or JPEG", {ANY_PHOTOGRAPH}},
    {"dark_frame", "a photograph: OpenEXR, TIFF, camera raw, PNG or JPEG", {ANY_PHOTOGRAPH}},
    {"camera_noise", "a record of `selvedge calibrate-camera`: .json", {[KIND_UNKNOWN] = true, [KIND_JSON] = true}},
    {"mesh", "a mesh: .obj", {[KIND_UNKNOWN] = true, [KIND_MESH] = true}},
    {"draft", "a draft: .wif", {[KIND_UNKNOWN] = true, [KIND_DRAFT] = true}},
    {"result", "the result of a job: result.json", {[KIND_UNKNOWN] = true, [KIND_JSON] = true}},
    {"report", "the report of a job: report.html", {[KIND_UNKNOWN] = true, [KIND_OTHER] = true}},
    {"rig", "a rig file: .json", {[KIND_UNKNOWN] = true, [KIND_JSON] = true}},
};

struct consistency_check {
    const struct job_sections *section;
    void (*found)(void *context, const struct error *fault);
    void *context;
};

static void check_ending(void *context, const char *name, const char *role)
{
    const struct consistency_check *search = context;
    struct error fault = {0};
    char field[sizeof fault.field];
    for (size_t i = 0; i < sizeof role_rule / sizeof role_rule[0]; i++) {
        const struct role_rule *r = &role_rule[i];
        if (strcmp(role, r->role) != 0 || r->kind[kind_of(name)]) continue;
        job_sections_file_key(search->section, name, field, sizeof field);
        error_set_field(&fault, STATUS_INVALID, field, "'%s' is '%s', which by its ending is not %s", field, name,
                        r->wanted);
        search->found(search->context, &fault);
    }
}

static void check_radians(const struct job_sections *section, const struct consistency_check *search)
{
    struct angle_span photograph = {0}, candidate = {0};
    struct error fault = {0};
    for (size_t i = 0; i < section->rows->n_photograph; i++) {
        const struct job_photograph *p = &section->rows->photograph[i];
        angle_span_add(&photograph, p->light_theta_deg, p->light_phi_deg, p->camera_theta_deg, p->camera_phi_deg,
                       p->cloth_rotation_deg);
    }
    for (size_t i = 0; i < section->fit->n_candidate && section->fit->candidate != NULL; i++) {
        const struct job_candidate *p = &section->fit->candidate[i];
        angle_span_add(&candidate, p->light_theta_deg, p->light_phi_deg, p->camera_theta_deg, p->camera_phi_deg,
                       p->cloth_rotation_deg);
    }
    for (int k = 0; k < 2; k++) {
        const struct angle_span *span = k == 0 ? &photograph : &candidate;
        if (!angle_span_in_radians(span)) continue;
        error_set_field(&fault, STATUS_INVALID, k == 0 ? "photographs" : "fit.candidates",
                        "the angles of '%s' look like radians: the largest one from the normal is %.3g; write degrees",
                        k == 0 ? "photographs" : "fit.candidates", span->theta);
        search->found(search->context, &fault);
    }
}

void job_consistency_check(const struct job_sections *section, void (*found)(void *context, const struct error *fault),
                           void *context)
{
    struct consistency_check search = {section, found, context};
    job_sections_visit_files(section, check_ending, &search);
    check_radians(section, &search);
}
