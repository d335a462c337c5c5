/* Three copies in one process: one linked, two loaded. Each reads the environments of the others and finds the same bits. */
#include <stdio.h>

#include "loaded.h"

int main(int count, char **path) {
    const work_library linked = WORK_LIBRARY;
    work_library copy[3] = {linked};
    work_memory memory[3];
    const wis_environment *environment[3];
    if (count != 3) return 2;
    work_paint();
    for (int i = 1; i < 3; i++) {
        if (!load(path[i], &copy[i])) return 2;
        if (copy[i].wis_direct == copy[i - 1].wis_direct) return 3;
    }
    for (int i = 0; i < 3; i++) {
        memset(&memory[i], 0, sizeof memory[i]);
        environment[i] = work_allocate(&copy[i], &memory[i]) ? work_build(&copy[i], &memory[i]) : NULL;
        if (!environment[i]) return 4;
    }
    const uint64_t expected = work_render(&copy[0], environment[0], &memory[0]);
    int same = expected != 0;
    for (int by = 0; by < 3; by++)
        for (int of = 0; of < 3; of++) same = same && work_render(&copy[by], environment[of], &memory[by]) == expected;
    for (int i = 0; i < 3; i++) work_release(&memory[i]);
    puts(same ? "three copies, nine pairs: the same bits" : "FAILED");
    return same ? EXIT_SUCCESS : EXIT_FAILURE;
}
