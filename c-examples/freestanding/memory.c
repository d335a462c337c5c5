/* The four functions that a compiler may call on its own. They are all that the library wants from outside. */
#include <stddef.h>

void *memcpy(void *restrict to, const void *restrict from, size_t count);
void *memmove(void *to, const void *from, size_t count);
void *memset(void *to, int value, size_t count);
int memcmp(const void *left, const void *right, size_t count);

void *memcpy(void *restrict to, const void *restrict from, size_t count) {
    unsigned char *d = to;
    const unsigned char *s = from;
    while (count--) *d++ = *s++;
    return to;
}

void *memmove(void *to, const void *from, size_t count) {
    unsigned char *d = to;
    const unsigned char *s = from;
    if (d < s)
        for (size_t i = 0; i < count; i++) d[i] = s[i];
    else
        while (count--) d[count] = s[count];
    return to;
}

void *memset(void *to, int value, size_t count) {
    unsigned char *d = to;
    while (count--) *d++ = (unsigned char)value;
    return to;
}

int memcmp(const void *left, const void *right, size_t count) {
    const unsigned char *a = left, *b = right;
    for (; count; count--, a++, b++)
        if (*a != *b) return *a < *b ? -1 : 1;
    return 0;
}
