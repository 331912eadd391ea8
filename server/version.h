/* The version that the daemon reports. */
#ifndef SELVEDGE_SERVER_VERSION_H
#define SELVEDGE_SERVER_VERSION_H

#define SELVEDGE_VERSION "0.1.0"

#endif
