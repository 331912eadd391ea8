#include "base/warning.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

void warning_send(const struct warning_sink *sink, const char *option, const char *format, ...)
{
    char text[600];
    va_list list;
    if (sink == NULL || sink->receive == NULL) return;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    sink->receive(sink->context, option, text);
}
