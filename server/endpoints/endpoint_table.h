/* The table of endpoints. */
#ifndef SELVEDGE_SERVER_ENDPOINT_TABLE_H
#define SELVEDGE_SERVER_ENDPOINT_TABLE_H

#include "server/http/http_request.h"

/* Finds the endpoint of a request. */
http_route_finder endpoint_find;

#endif
