/* The files that a job document names, and their SHA-256. The source files are included here, because the parts of the
 * client are in no library. */
#include "clients/cli/commands/cli_job_files.c" /* NOLINT */
#include "clients/cli/text/cli_text.c"          /* NOLINT */

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static status list_of(const char *text, struct cli_file_list *list, struct error *err)
{
    json_t *document = json_loads(text, 0, NULL);
    assert_non_null(document);
    status s = cli_job_files_list(document, "in", list, err);
    json_decref(document);
    return s;
}

static void test_every_file_once(void **state)
{
    (void)state;
    struct cli_file_list list;
    assert_int_equal(list_of("{\"volume\":{\"files\":[\"a.mhd\",\"a.raw\"]},\"measurements\":{\"file\":\"m.csv\"},"
                             "\"photographs\":[{\"file\":\"p0.exr\"},{\"file\":\"p1.exr\"},{\"file\":\"p0.exr\"}]}",
                             &list, NULL),
                     STATUS_OK);
    static const char *const name[] = {"a.mhd", "a.raw", "m.csv", "p0.exr", "p1.exr"};
    static const char *const role[] = {"volume", "volume", "measurements", "photograph", "photograph"};
    assert_int_equal(list.n_file, 5);
    for (size_t i = 0; i < 5; i++) {
        assert_string_equal(list.file[i].name, name[i]);
        assert_string_equal(list.file[i].role, role[i]);
        assert_memory_equal(list.file[i].path, "in/", 3);
        assert_string_equal(list.file[i].path + 3, name[i]);
    }
    cli_job_files_release(&list);
    assert_int_equal(list_of("{\"fibers\":{\"file\":\"c.hair\"}}", &list, NULL), STATUS_OK);
    assert_string_equal(list.file[0].role, "fibers");
    cli_job_files_release(&list);
    assert_int_equal(list_of("{}", &list, NULL), STATUS_OK); /* the server says what is missing */
    assert_int_equal(list.n_file, 0);
    cli_job_files_release(&list);
}

static void test_bad_names(void **state)
{
    (void)state;
    struct cli_file_list list;
    struct error err = {0};
    assert_int_equal(list_of("{\"volume\":{\"files\":[\"a\",\"scans/a.tif\"]}}", &list, &err), STATUS_INVALID);
    assert_string_equal(err.field, "volume.files[1]");
    assert_int_equal(list_of("{\"photographs\":[{\"set\":\"fit\"}]}", &list, &err), STATUS_INVALID);
    assert_string_equal(err.field, "photographs[0].file");
    assert_int_equal(list_of("{\"measurements\":{\"file\":7}}", &list, &err), STATUS_INVALID);
    assert_string_equal(err.field, "measurements.file");
}

static bool stop_at_once(void *context, uint64_t n)
{
    (void)context, (void)n;
    return false;
}

static void test_hash(void **state)
{
    (void)state;
    char path[] = "/tmp/selvedge_hash_XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, "abc", 3), 3);
    close(fd);
    struct cli_file f = {.path = path};
    struct error err = {0};
    assert_int_equal(cli_file_hash(&f, NULL, NULL, &err), STATUS_OK);
    assert_int_equal(f.n_bytes, 3);
    /* FIPS 180-2, example B.1 */
    assert_string_equal(f.sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_int_equal(cli_file_hash(&f, stop_at_once, NULL, &err), STATUS_CANCELLED);
    unlink(path);
    assert_int_equal(cli_file_hash(&f, NULL, NULL, &err), STATUS_NOT_FOUND);
    f.path = "/";
    assert_int_equal(cli_file_hash(&f, NULL, NULL, &err), STATUS_INVALID);
}

/* A strict file is opened only where neither it nor its folder is a link, also if it was a file when it was
 * listed. */
static void test_strict_files_are_no_links(void **state)
{
    (void)state;
    char folder[] = "/tmp/selvedge_links_XXXXXX", file[64], link[64], linked_folder[64], through[96];
    assert_non_null(mkdtemp(folder));
    snprintf(file, sizeof file, "%s/file", folder);
    snprintf(link, sizeof link, "%s/link", folder);
    snprintf(linked_folder, sizeof linked_folder, "%s.link", folder);
    snprintf(through, sizeof through, "%s/file", linked_folder);
    FILE *f = fopen(file, "w");
    assert_non_null(f);
    fclose(f);
    assert_int_equal(symlink(file, link), 0);
    assert_int_equal(symlink(folder, linked_folder), 0);
    char *const path[] = {file, link, through};
    for (size_t i = 0; i < 3; i++) {
        struct error err = {0};
        struct cli_file at = {.path = path[i]};
        assert_int_equal(cli_file_hash(&at, NULL, NULL, &err), STATUS_OK);
        at.no_links = true;
        assert_int_equal(cli_file_hash(&at, NULL, NULL, &err), i == 0 ? STATUS_OK : STATUS_IO);
        assert_true(i == 0 || err.errno_value == (i == 1 ? ELOOP : ENOTDIR));
    }
    unlink(link);
    unlink(file);
    rmdir(folder);
    unlink(linked_folder);
    struct cli_file_list list;
    json_t *document = json_loads("{\"measurements\":{\"file\":\"m.csv\"}}", 0, NULL);
    assert_int_equal(cli_job_files_list_strict(document, "in", &list, NULL), STATUS_OK);
    assert_true(list.n_file == 1 && list.file[0].no_links);
    cli_job_files_release(&list);
    json_decref(document);
}

int main(void)
{
    if (sodium_init() < 0) return 1;
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_every_file_once),
        cmocka_unit_test(test_bad_names),
        cmocka_unit_test(test_hash),
        cmocka_unit_test(test_strict_files_are_no_links),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
