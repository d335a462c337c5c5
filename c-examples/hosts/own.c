/* A host that exports names of the library, and loads a shared library that does: a plug-in calls those of its own archive. */
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Not those of wis.h: no plug-in may come here. */
static int called;
int wis_version(void);
int wis_environment_size(void);
int wis_direct(void);
int wis_version(void) { return ++called; }
int wis_environment_size(void) { return ++called; }
int wis_direct(void) { return ++called; }

/* A function of the plug-in, or of another library. */
static void *found_in(void *handle, const char *name) {
    void *found = handle ? dlsym(handle, name) : NULL;
    if (!found) fprintf(stderr, "%s: not found\n", name);
    return found;
}

/* Whether a plug-in calls its own functions. */
static int plays(const char *path) {
    uint32_t (*version)(void);
    uint64_t (*work)(void);
    void *plugin = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    void *const functions[2] = {found_in(plugin, "plugin_version"), found_in(plugin, "plugin_work")};
    if (!functions[0] || !functions[1]) return 0;
    if (dlsym(plugin, "wis_version") != NULL) return 0;
    memcpy(&version, &functions[0], sizeof version);
    memcpy(&work, &functions[1], sizeof work);
    return version() > 1 && work() != 0 && called == 0;
}

/* The plug-in twice, as two files, and a shared library for all between. */
int main(int count, char **path) {
    if (count != 4) return 2;
    const int before = plays(path[1]);
    if (!dlopen(path[3], RTLD_NOW | RTLD_GLOBAL)) return 2;
    const int passed = before && plays(path[2]);
    puts(passed ? "a plug-in calls its own functions, whatever host and libraries export" : "FAILED");
    return passed ? EXIT_SUCCESS : EXIT_FAILURE;
}
