/* vec3: the few vector products of the motion pass. Saturations are counted as num.h says. */
#ifndef TAUPERP_VEC3_H
#define TAUPERP_VEC3_H

#include "robot.h"

static inline vec3_t vec3_add(vec3_t a, vec3_t b, uint32_t *saturations) {
    return (vec3_t){
        .x = num_add(a.x, b.x, saturations), .y = num_add(a.y, b.y, saturations), .z = num_add(a.z, b.z, saturations)};
}

static inline vec3_t vec3_subtract(vec3_t a, vec3_t b, uint32_t *saturations) {
    return (vec3_t){.x = num_subtract(a.x, b.x, saturations),
                    .y = num_subtract(a.y, b.y, saturations),
                    .z = num_subtract(a.z, b.z, saturations)};
}

static inline num_t vec3_dot(vec3_t a, vec3_t b, uint32_t *saturations) {
    return num_narrow(num_wide(a.x, b.x) + num_wide(a.y, b.y) + num_wide(a.z, b.z), saturations);
}

static inline vec3_t vec3_cross(vec3_t a, vec3_t b, uint32_t *saturations) {
    return (vec3_t){.x = num_narrow(num_wide(a.y, b.z) - num_wide(a.z, b.y), saturations),
                    .y = num_narrow(num_wide(a.z, b.x) - num_wide(a.x, b.z), saturations),
                    .z = num_narrow(num_wide(a.x, b.y) - num_wide(a.y, b.x), saturations)};
}

#endif
