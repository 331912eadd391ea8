/* Receives the warnings of a computation: facts that a user should know although they stop nothing. */
#ifndef SELVEDGE_BASE_WARNING_H
#define SELVEDGE_BASE_WARNING_H

struct warning_sink {
    /* Receives one warning. option: the id of the job option that it is about (option_id.h), or OPTION_NONE when the
     * text begins with its subject. Both texts live only during the call. */
    void (*receive)(void *context, const char *option, const char *text);
    void *context;
};

/* Formats the text as printf does, cut after 599 bytes, and gives it to the sink. Without a sink (NULL, or receive
 * NULL) the warning is dropped. */
void warning_send(const struct warning_sink *sink, const char *option, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
