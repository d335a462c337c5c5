/* Reads a map as the other examples do, and prints its size and the sums of its channels: what scripts/check-maps.sh compares. */
#include <stdio.h>
#include <stdlib.h>

#include "../render/light.h"

int main(int count, char **arguments) {
    Light light = {0};
    const char *fault = count == 2 ? light_read(&light, arguments[1]) : "usage: read FILE";
    double sum[3] = {0.0, 0.0, 0.0};
    if (fault != NULL) {
        fprintf(stderr, "read: %s\n", fault);
        return EXIT_FAILURE;
    }
    for (size_t i = 0; i < (size_t)light.width * light.height * 3; i++) {
        sum[i % 3] += (double)light.texels[i];
    }
    printf("%u x %u: %.9g %.9g %.9g, first %.9g\n", light.width, light.height, sum[0], sum[1], sum[2], (double)light.texels[0]);
    light_free(&light);
    return EXIT_SUCCESS;
}
