/* A consumer in C and C++ that calls the functions of the C library whose names Rust's archives bring along. */
#include <wis.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

static int failures = 0;

static void expect(double value, double expected, const char *name) {
    if (value == expected) return;
    printf("FAILED: %s = %g\n", name, value);
    failures++;
}

int main(void) {
    /* The compiler must not know the values. */
    volatile double x = 7.5, y = 2.0, nought = 0.0;
    volatile float a = 7.5f, b = 2.0f, c = 0.5f;
    expect(fmod(x, y), 1.5, "fmod");
    expect(fmodf(a, b), 1.5, "fmodf");
    expect(fma(x, y, nought), 15.0, "fma");
    expect(fmaf(a, b, c), 15.5, "fmaf");
    expect(cbrt(x + 0.5), 2.0, "cbrt");
    expect(cbrtf(a + c), 2.0, "cbrtf");
    expect(sqrt(x * 1.2), 3.0, "sqrt");
    expect(sqrtf(b * 2.0f), 2.0, "sqrtf");
    expect(round(x), 8.0, "round");
    expect(roundf(a), 8.0, "roundf");
    expect(fmin(x, y), 2.0, "fmin");
    expect(fmaxf(a, b), 7.5, "fmaxf");
    expect(trunc(x), 7.0, "trunc");
    expect(ceilf(a), 8.0, "ceilf");
    expect(strcmp(wis_status_string(WIS_OK), "ok"), 0.0, "wis_status_string");
    puts(failures ? "FAILED" : "the C library's mathematics are the C library's");
    return failures != 0;
}
