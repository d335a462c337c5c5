/* Beside another Rust library, which has the standard library, a panic handler and an allocator of its own. */
#include <stdio.h>

#include "work.h"

extern uint64_t other_sum(uint64_t count);

int main(void) {
    const work_library wis = WORK_LIBRARY;
    work_paint();
    const int passed = work_all(&wis) != 0 && other_sum(100) == 5050;
    puts(passed ? "beside another Rust library: both work" : "FAILED");
    return passed ? EXIT_SUCCESS : EXIT_FAILURE;
}
