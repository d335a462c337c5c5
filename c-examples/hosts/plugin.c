/* A plug-in with a copy of the library of its own, from the archive. */
#include "work.h"

uint32_t plugin_version(void);
uint64_t plugin_work(void);

uint32_t plugin_version(void) { return wis_version(); }

uint64_t plugin_work(void) {
    const work_library wis = WORK_LIBRARY;
    work_paint();
    return work_all(&wis);
}
