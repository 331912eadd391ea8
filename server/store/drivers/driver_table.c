#include "server/store/drivers/driver_table.h"

#include <string.h>

static const struct store_driver *const drivers[] = {&store_postgres, &store_sqlite};

const struct store_driver *store_driver_of(const char *address)
{
    size_t i = 0; /* the last one takes any path */
    while (strncmp(address, drivers[i]->scheme, strlen(drivers[i]->scheme)) != 0) i++;
    return drivers[i];
}
