/* Ends a program that was built for a better processor, with a sentence, before it would end by an illegal instruction.
 * It runs before main, because the compiler may use any instruction in main; this file alone is compiled for every
 * processor (Makefile), and the programs link it by its name. It is the one place below main that prints and ends. */
#include <string.h>
#include <unistd.h>

/* The symbol that the linker asks for. */
extern const char processor_required[];
#ifdef __x86_64__
const char processor_required[] = "x86-64-v3 (AVX2, FMA, BMI2; docs/operating.md)";

__attribute__((constructor(101))) static void check_processor(void)
{
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2")) return;
    const char *const part[] = {"error: this processor cannot run this program, which was built for ",
                                processor_required, "\n"};
    for (size_t i = 0; i < 3; i++)
        if (write(STDERR_FILENO, part[i], strlen(part[i])) < 0) break;
    _exit(1);
}
#else
const char processor_required[] = "any processor of this architecture";
#endif
