/* A copy of the library that is loaded at run time. */
#ifndef LOADED_H
#define LOADED_H
#include <dlfcn.h>
#include "work.h"

/* Fills in the functions of a file; null if it cannot be loaded. dlclose gives it back. */
static void *load(const char *path, work_library *wis) {
    void *handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    int complete = handle != NULL;
#define LOAD(name)                                                                                                     \
    if (complete) {                                                                                                    \
        void *found = dlsym(handle, #name);                                                                            \
        complete = found != NULL;                                                                                      \
        memcpy(&wis->name, &found, sizeof found);                                                                      \
    }
    WORK_FUNCTIONS(LOAD)
    if (complete || handle == NULL) return handle;
    dlclose(handle);
    return NULL;
}

#endif
