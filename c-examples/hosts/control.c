/* Hosts that flush denormals to zero, round otherwise or unmask every exception: the same bits, and the control word stays. */
#define _GNU_SOURCE
#include <fenv.h>
#include <stdio.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "work.h"

int main(void) {
    const work_library wis = WORK_LIBRARY;
    int failed = 0;
    work_paint();
    const uint64_t expected = work_all(&wis);
    const int modes[] = {FE_TONEAREST, FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    for (int i = 0; i < 4; i++) {
        fesetround(modes[i]);
        failed |= work_all(&wis) != expected || fegetround() != modes[i];
    }
    fesetround(FE_TONEAREST);
#if defined(__x86_64__)
    const unsigned plain = _mm_getcsr(), flags = 0x3f, flushing = 0x8040;
    _mm_setcsr(plain | flushing);
    failed |= work_all(&wis) != expected || (_mm_getcsr() & ~flags) != ((plain | flushing) & ~flags);
    _mm_setcsr(plain);
#endif
#if defined(__GLIBC__) && defined(__x86_64__)
    /* The first inexact result of the library would end the process; the host's own numbers are exact. */
    work_memory memory;
    memset(&memory, 0, sizeof memory);
    failed |= !work_allocate(&wis, &memory);
    feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW | FE_UNDERFLOW | FE_INEXACT);
    const wis_environment *environment = work_build(&wis, &memory);
    const uint64_t found = environment && work_compare(&wis, environment, &memory) ? work_render(&wis, environment, &memory) : 0;
    const int unmasked = fegetexcept();
    fedisableexcept(FE_ALL_EXCEPT);
    failed |= found != expected || unmasked != FE_ALL_EXCEPT;
    work_release(&memory);
#endif
    failed |= expected == 0;
    puts(failed ? "FAILED" : "rounding, flushing and unmasked exceptions: the same bits");
    return failed;
}
