/* Photographs of a bowl, made by rays (bowl_rays.h) of a fiber whose profile is known: the cells that come back, their
 * errors, the fit to them, and inputs that are refused. */
#include "base/angle.h"
#include "optimizer/fit/profile/profile_fit.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/photographs/profile/bowl_profile.h"
#include "tests/support/fiber/bowl_rays.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define RADIUS 75.0
#define HEIGHT 73.0
#define SAID                                                                                                           \
    "\"radius_mm\":75,\"height_mm\":73,\"reflectance\":0.2,\"fiber_mm\":[0.8,-1.2,0.5],\"cell_deg\":5,\"marks\":[%s]"
#define ONE "\"photographs\":[{\"file\":\"a.exr\",\"background\":\"dark.exr\",\"theta_i_deg\":20}]"
#define BOTH                                                                                                           \
    "\"photographs\":[{\"file\":\"a.exr\",\"background\":\"dark.exr\",\"theta_i_deg\":20},"                            \
    "{\"file\":\"b.exr\",\"background\":\"dark.exr\",\"theta_i_deg\":-15,\"phi_i_deg\":180,\"fiber_turn_deg\":40}]"
enum { PX = 320, TEXT = 4096 };

static struct bowl_device device_of(const struct scattering_model *m, const struct scattering_state *state)
{
    return (struct bowl_device){.radius = RADIUS,
                                .height = HEIGHT,
                                .reflectance = 0.2,
                                .fiber = {0.8, -1.2, 0.5},
                                .lit_length = 4,
                                .lamp = {sin(20 * RAD_PER_DEG), cos(20 * RAD_PER_DEG), 0},
                                .camera = {30, -45, 600},
                                .look_at = {1, 2, -30},
                                .turn_rad = 0.4,
                                .focal_px = 1150,
                                .width = PX,
                                .picture_height = PX,
                                .model = m,
                                .state = state,
                                .strength = M_PI * RADIUS * RADIUS, /* the scale of the profile is 1 */
                                .background = 0.002,
                                .noise = 0.0001,
                                .samples = 2};
}

/* Marks on the rim, on the wall and at the lowest point; those of `flat` on the rim alone. */
static void marks_of(const struct bowl_device *d, bool flat, char text[TEXT])
{
    const double rim = HEIGHT - RADIUS, z[] = {rim, flat ? rim : -50.0};
    size_t n = 0;
    for (int i = 0; i < 16; i++) {
        const double turn = i * 22.5 * RAD_PER_DEG, r = sqrt(RADIUS * RADIUS - z[i % 2] * z[i % 2]),
                     at[3] = {r * cos(turn), r * sin(turn), z[i % 2]};
        double px[2];
        bowl_rays_project(d, at, px);
        n += (size_t)snprintf(text + n, TEXT - n, "%s{\"at_mm\":[%.6f,%.6f,%.6f],\"px\":[%.4f,%.4f]}", i > 0 ? "," : "",
                              at[0], at[1], at[2], px[0], px[1]);
    }
}

/* Parses the job with this section. */
static status parse(const char *bowl, struct job_document **doc, struct error *err)
{
    char text[2 * TEXT];
    snprintf(text, sizeof text, "{\"sample\":\"f\",\"profile\":{\"bowl\":{%s}},\"fit\":{\"model\":\"two_lobe.v1\"}}",
             bowl);
    return job_document_parse(text, strlen(text), doc, err);
}

struct scene {
    const struct scattering_model *model;
    double truth[SCATTERING_MAX_PARAM];
    struct scattering_state *state;
    struct bowl_device device;
    char marks[TEXT];
};

static void begin(struct scene *s)
{
    struct error err = {0};
    s->model = scattering_find("two_lobe.v1");
    for (size_t p = 0; p < s->model->n_param; p++) s->truth[p] = s->model->param[p].start;
    s->truth[scattering_param_index(s->model, "beta_R")] = 0.15; /* lobes that cells of 5 degrees resolve */
    s->truth[scattering_param_index(s->model, "beta_TT")] = 0.5;
    s->truth[scattering_param_index(s->model, "gamma_TT")] = 0.5;
    for (size_t p = 0; p < s->model->n_param; p++) /* grey, as the profile is */
        if (s->model->param[p].kind == PARAM_COLOUR && s->model->param[p].channel > 0) s->truth[p] = s->truth[p - 1];
    assert_int_equal(s->model->prepare(s->truth, &s->state, &err), STATUS_OK);
    s->device = device_of(s->model, s->state);
    marks_of(&s->device, false, s->marks);
}

static void write_photographs(void **state, struct scene *s)
{
    static const char *const name[] = {"a.exr", "b.exr", "dark.exr"};
    for (int i = 0; i < 3; i++) {
        struct bowl_device d = s->device;
        struct image im;
        if (i == 1) {
            d.lamp[0] = sin(-15 * RAD_PER_DEG);
            d.lamp[1] = -cos(15 * RAD_PER_DEG);
        }
        assert_int_equal(bowl_rays_photograph(&d, i < 2, (unsigned)i + 1, &im), STATUS_OK);
        assert_int_equal(image_write_exr(&im, scratch_path(state, name[i]), NULL), STATUS_OK);
        image_release(&im);
    }
}

static void load(void **state, const struct scene *s, const char *photographs, struct fiber_profile *profile,
                 struct bowl_record *record)
{
    char bowl[TEXT + 512];
    struct job_document *doc = NULL;
    struct error err = {0};
    snprintf(bowl, sizeof bowl, SAID ",%s", s->marks, photographs);
    if (parse(bowl, &doc, &err) != STATUS_OK ||
        bowl_profile_load(profile, &doc->profile->bowl, doc->setup, doc->rows, *state, record, &err) != STATUS_OK)
        fail_msg("%s: %s", err.field, err.text);
    job_document_free(doc);
}

/* Cells come back within their errors; the fit to them within its own. Each error is from the scatter of at least
 * 24 - 6 degrees of freedom, so that squares of deviations over errors have a mean between 1 and 18 / 16. */
static void known_profile(void **state)
{
    struct scene s;
    struct fiber_profile p;
    struct bowl_record record;
    struct profile_fit fit;
    struct error err = {0};
    begin(&s);
    write_photographs(state, &s);
    load(state, &s, BOTH, &p, &record);
    double *truth = calloc(p.n, sizeof *truth), chi_square = 0, mean = 0, noise = 0;
    assert_non_null(truth);
    assert_int_equal(profile_model_predict(s.model, s.truth, &p, &(struct profile_work){0}, truth, NULL, &err),
                     STATUS_OK);
    assert_true(p.has_phi_i); /* the second photograph is from the other side, of a fiber turned by 40 degrees */
    for (size_t i = 0; i < p.n; i++) {
        const double phi_i_deg = p.row[i].theta_i_rad > 0 ? 0 : 140;
        assert_true(fabs(p.row[i].phi_i_rad - phi_i_deg * RAD_PER_DEG) < 1e-9);
        chi_square += pow((p.row[i].radiance[0] - truth[i]) / p.row[i].se[0], 2) / (double)p.n;
        mean += truth[i] / (double)p.n;
        noise += p.row[i].se[0] / (double)p.n;
    }
    print_message(
        "%zu cells, mean %.4g, errors of %.2g: squares over stated ones %.3f; camera off by %.3g mm, marks %.2g px; "
        "reflected %.2f of the mean\n",
        p.n, mean, noise, chi_square,
        hypot(
            hypot(record.camera.position_mm[0] - s.device.camera[0], record.camera.position_mm[1] - s.device.camera[1]),
            record.camera.position_mm[2] - s.device.camera[2]),
        record.camera.rms_px, record.shot[0].reflected / (record.shot[0].mean - record.shot[0].background));
    assert_true(p.n > 1000 && noise < 0.1 * mean);
    assert_true(chi_square > 1 - 4 * sqrt(2.0 / (double)p.n) && chi_square < 18.0 / 16 + 4 * sqrt(2.0 / (double)p.n));
    struct fit_parameter parameter[SCATTERING_MAX_PARAM];
    struct fit_option option;
    fit_option_init(&option);
    for (size_t k = 0; k < s.model->n_param; k++) {
        const struct param_info *info = &s.model->param[k];
        parameter[k] = (struct fit_parameter){info->lower, info->upper, 0.5 * (info->start + info->lower), false};
    }
    const struct profile_problem problem = {
        .model = s.model, .profile = &p, .parameter = parameter, .option = &option, .scale = 1};
    assert_int_equal(profile_fit_run(&problem, "bowl", &fit, &err), STATUS_OK);
    for (size_t k = 0; k < s.model->n_param; k++) {
        print_message("%-12s %.5g +- %.2g, true %.5g\n", s.model->param[k].name, fit.param[k], fit.se_param[k],
                      s.truth[k]);
        assert_true(fabs(fit.param[k] - s.truth[k]) < 4 * fit.se_param[k]);
    }
    assert_true(fit.converged);
    profile_fit_release(&fit);
    fiber_profile_release(&p);
    free(truth);
    s.model->release(s.state);
}

/* The table that is written is read again as the same rows. */
static void written_table(void **state)
{
    struct scene s;
    struct fiber_profile p, again;
    struct error err = {0};
    char *text = NULL;
    size_t n = 0;
    begin(&s);
    write_photographs(state, &s);
    load(state, &s, ONE, &p, NULL);
    FILE *out = open_memstream(&text, &n);
    assert_non_null(out);
    p.row[0].radiance[0] = -2 * p.row[0].se[0]; /* noise about 0 */
    fiber_profile_print(&p, out);
    fclose(out);
    if (fiber_profile_parse(&again, text, n, "p.csv", NAN, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_true(again.n == p.n && again.has_se && again.n_channel == 1);
    for (size_t i = 0; i < p.n; i++) {
        assert_true(fabs(again.row[i].radiance[0] - p.row[i].radiance[0]) <= 1e-6 * fabs(p.row[i].radiance[0]));
        assert_true(fabs(again.row[i].phi_rad - p.row[i].phi_rad) < 1e-6);
    }
    fiber_profile_release(&p);
    fiber_profile_release(&again);
    free(text);
    s.model->release(s.state);
}

static void refused_section(const char *bowl, const char *field, const char *says)
{
    struct job_document *doc = NULL;
    struct error err = {0};
    const status s = parse(bowl, &doc, &err);
    if (s == STATUS_OK || strcmp(err.field, field) != 0 || strstr(err.text, says) == NULL)
        fail_msg("expected '%s' with '%s', got '%s': %s", field, says, err.field, err.text);
    job_document_free(doc);
}

static void refused_documents(void **unused)
{
    const char *const marks = "{\"at_mm\":[1,0,0],\"px\":[1,1]},{\"at_mm\":[1,0,0],\"px\":[1,1]},"
                              "{\"at_mm\":[1,0,0],\"px\":[1,1]},{\"at_mm\":[1,0,0],\"px\":[1,1]}";
    static const struct {
        const char *geometry, *photographs, *field, *says;
    } wrong[] = {
        {"\"height_mm\":80", ONE, "profile.bowl.height_mm", "larger than the radius"},
        {"\"fiber_mm\":[30,0,0]", ONE, "profile.bowl.fiber_mm", "30 mm from the center"},
        {"\"height_mm\":73,\"fiber_mm\":[0,0,-5]", ONE, "profile.bowl.fiber_mm", "below the rim"},
        {"\"height_mm\":73", "\"photographs\":[{\"file\":\"a.exr\",\"theta_i_deg\":0,\"phi_i_deg\":30}]",
         "profile.bowl.photographs[0].phi_i_deg", "lamp is below the rim"},
        {"\"rim_deg\":3", "\"photographs\":[{\"file\":\"a.exr\"}]", "profile.bowl.photographs[0].theta_i_deg", ""},
        {"\"rim_deg\":3", "\"photographs\":[]", "profile.bowl.photographs", "list of 1 to"},
    };
    char text[TEXT];
    (void)unused;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        snprintf(text, sizeof text, "\"radius_mm\":75,\"reflectance\":0.2,%s,\"marks\":[%s],%s", wrong[i].geometry,
                 marks, wrong[i].photographs);
        refused_section(text, wrong[i].field, wrong[i].says);
    }
    snprintf(text, sizeof text, "\"radius_mm\":75,\"reflectance\":0.2,\"marks\":[{\"at_mm\":[1,0,0],\"px\":[1,1]}],%s",
             ONE);
    refused_section(text, "profile.bowl.marks", "4 marks");
}

/* A picture of another size, and a white one. */
static void write_useless(void **state)
{
    struct image im;
    assert_int_equal(image_init(&im, 40, PX, 3, NULL), STATUS_OK);
    assert_int_equal(image_write_exr(&im, scratch_path(state, "small.exr"), NULL), STATUS_OK);
    image_release(&im);
    assert_int_equal(image_init(&im, PX, PX, 3, NULL), STATUS_OK); /* white everywhere */
    for (size_t k = 0; k < 3 * PX * PX; k++) im.pixel[k] = 1;
    assert_int_equal(image_write_png(&im, 1, scratch_path(state, "white.png"), NULL), STATUS_OK);
    image_release(&im);
}

/* Fails unless the photographs are refused with that field (any where it is "") and both texts. */
static void refused_files(void **state, const char *marks, const char *photographs, const char *field,
                          const char *const says[2])
{
    struct job_document *doc = NULL;
    struct fiber_profile p;
    struct error err = {0};
    char bowl[2 * TEXT];
    snprintf(bowl, sizeof bowl, "\"radius_mm\":75,\"height_mm\":73,\"reflectance\":0.2,\"marks\":[%s],%s", marks,
             photographs);
    assert_int_equal(parse(bowl, &doc, &err), STATUS_OK);
    assert_true(bowl_profile_load(&p, &doc->profile->bowl, doc->setup, doc->rows, *state, NULL, &err) != STATUS_OK);
    job_option_name_field(STATUS_INVALID, &err);
    if ((field[0] != '\0' && strcmp(err.field, field) != 0) || strstr(err.text, says[0]) == NULL ||
        strstr(err.text, says[1]) == NULL)
        fail_msg("%s: '%s': %s", photographs, err.field, err.text);
    job_document_free(doc);
}

static void refused_photographs(void **state)
{
    struct scene s;
    char flat[TEXT], mirrored[TEXT];
    begin(&s);
    s.device.samples = 1;
    write_photographs(state, &s);
    marks_of(&s.device, true, flat);
    memcpy(mirrored, s.marks, sizeof mirrored);
    for (char *at = mirrored; (at = strstr(at, "\"px\":[")) != NULL; at += 6) at[6] = at[6] == '2' ? '1' : at[6];
    write_useless(state);
    const struct {
        const char *marks, *photographs, *field, *says[2];
    } wrong[] = {
        {s.marks,
         "\"photographs\":[{\"file\":\"a.exr\",\"background\":\"small.exr\",\"theta_i_deg\":20}]",
         "profile.bowl.photographs[0].file",
         {"'small.exr'", "40 x 320 pixels"}},
        {s.marks,
         "\"photographs\":[{\"file\":\"a.exr\",\"theta_i_deg\":20},{\"file\":\"small.exr\",\"theta_i_deg\":20}]",
         "profile.bowl.photographs[1].file",
         {"'small.exr'", "'a.exr' has 320 x 320"}},
        {s.marks,
         "\"mask\":\"small.exr\",\"photographs\":[{\"file\":\"a.exr\",\"theta_i_deg\":20}]",
         "profile.bowl.mask",
         {"'small.exr'", "40 x 320"}},
        {s.marks,
         "\"photographs\":[{\"file\":\"dark.exr\",\"background\":\"a.exr\",\"theta_i_deg\":20}]",
         "profile.bowl.photographs[0].file",
         {"'a.exr' is brighter", "exchanged"}},
        {s.marks,
         "\"photographs\":[{\"file\":\"white.png\",\"transfer\":\"srgb\",\"theta_i_deg\":20}]",
         "profile.bowl.photographs[0].file",
         {"'white.png'", "saturated"}},
        {s.marks,
         "\"cell_deg\":0.25,\"photographs\":[{\"file\":\"a.exr\",\"theta_i_deg\":20}]",
         "profile.bowl.photographs[0].file",
         {"no cell of 0.25", "'cell_deg' larger"}},
        {flat,
         "\"photographs\":[{\"file\":\"a.exr\",\"theta_i_deg\":20}]",
         "profile.bowl.focal_px",
         {"do not tell the focal length", "different heights"}},
        {mirrored,
         "\"photographs\":[{\"file\":\"a.exr\",\"theta_i_deg\":20}]",
         "",
         {"no place of the camera", "worst"}},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        refused_files(state, wrong[i].marks, wrong[i].photographs, wrong[i].field, wrong[i].says);
    s.model->release(s.state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(known_profile, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(written_table, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test(refused_documents),
        cmocka_unit_test_setup_teardown(refused_photographs, scratch_folder_setup, scratch_folder_teardown)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
