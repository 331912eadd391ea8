/* Places of databases: the address of a server, its kind, and the space that SQLite reserves for its log. */
#include "server/store/drivers/driver_table.h"
#include "server/store/store_cluster.h"
#include "server/store/store_settings.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void test_the_address_of_a_server(void **state)
{
    (void)state;
    static struct settings s;
    struct store_place place;
    struct error err = {0};
    snprintf(s.data, sizeof s.data, "/data");
    assert_int_equal(store_settings_place(&s, &place, &err), STATUS_OK);
    assert_string_equal(place.address, "/data/selvedge.db");
    store_place_release(&place);
    snprintf(s.store, sizeof s.store, "postgresql://someone@host/cloth");
    assert_int_equal(store_settings_place(&s, &place, &err), STATUS_OK);
    assert_string_equal(place.address, "postgresql://someone@host/cloth");
    store_place_release(&place);
    snprintf(s.store, sizeof s.store, "mysql://host/cloth");
    assert_int_equal(store_settings_place(&s, &place, &err), STATUS_INVALID);
}

static void test_the_kind_of_a_server(void **state)
{
    (void)state;
    static const struct {
        const char *letters;
        bool syncs, encrypted, local;
    } answer[] = {{"tff", true, false, false}, {"ftf", false, true, false}, {"fft", false, false, true},
                  {"ttt", true, true, true},   {"", false, false, false},   {"t", true, false, false},
                  {"ft", false, true, false}};
    for (size_t i = 0; i < sizeof answer / sizeof *answer; i++) {
        struct store_server server;
        store_server_read(answer[i].letters, &server);
        assert_int_equal(server.syncs, answer[i].syncs);
        assert_int_equal(server.encrypted, answer[i].encrypted);
        assert_int_equal(server.local, answer[i].local);
    }
}

static void test_the_space_for_a_log(void **state)
{
    (void)state;
    assert_int_equal(store_sqlite_log_bytes(0), 0);
    assert_int_equal(store_sqlite_log_bytes(1 << 20), 3 << 18);       /* three quarters of little space */
    assert_int_equal(store_sqlite_log_bytes(4 << 20), 1 << 20);       /* a mebibyte */
    assert_int_equal(store_sqlite_log_bytes(16 << 20), 2 << 20);      /* an eighth */
    assert_int_equal(store_sqlite_log_bytes(1LL << 40), 1100 * 4120); /* the usual size */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_address_of_a_server),
        cmocka_unit_test(test_the_kind_of_a_server),
        cmocka_unit_test(test_the_space_for_a_log),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
