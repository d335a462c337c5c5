/* The client's loop for the harness: each ray goes to a function of Rust. See environment.rs. */
#include "../../c-examples/direct.h"

struct Reflected {
    void (*add)(void *client, const float wi[3], float weight);
    void *client;
};

static void add_light(Reflected *sum, const float wi[3], float weight) { sum->add(sum->client, wi, weight); }

wis_status harness_direct_light(wis_sampler *sampler, const wis_environment *environment, const wis_point *point, uint32_t rays,
                                wis_ray *ray, Reflected *sum);

wis_status harness_direct_light(wis_sampler *sampler, const wis_environment *environment, const wis_point *point, uint32_t rays,
                                wis_ray *ray, Reflected *sum) {
    return direct_light(sampler, environment, point, rays, ray, sum);
}
