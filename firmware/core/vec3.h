/* vec3: vector products of the motion pass. num.h states how saturations are counted. */
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

/* Squares of three components fit into num_wide_t while each component is below VEC3_SQUARED. Larger vectors are
 * divided by four first. */
#define VEC3_SQUARED NUM(128)

static inline bool vec3_is_large(vec3_t v) {
    return (num_abs(v.x) >= VEC3_SQUARED) || (num_abs(v.y) >= VEC3_SQUARED) || (num_abs(v.z) >= VEC3_SQUARED);
}

static inline vec3_t vec3_quarter(vec3_t v) {
    return (vec3_t){.x = v.x / 4, .y = v.y / 4, .z = v.z / 4};
}

static inline num_wide_t vec3_square(vec3_t v) {
    return num_wide(v.x, v.x) + num_wide(v.y, v.y) + num_wide(v.z, v.z);
}

/* v / |v|; zero for zero. */
static inline vec3_t vec3_unit(vec3_t v, uint32_t *saturations) {
    const vec3_t u = vec3_is_large(v) ? vec3_quarter(v) : v;
    const num_wide_t square = vec3_square(u);
    if (!(square > num_widen(NUM(0)))) {
        return u;
    }
    const num_inverse_t inverse = num_inverse_root(square);
    return (vec3_t){.x = num_times(u.x, inverse, saturations),
                    .y = num_times(u.y, inverse, saturations),
                    .z = num_times(u.z, inverse, saturations)};
}

/* The part of v perpendicular to a unit vector; all of v if that vector is zero. */
static inline vec3_t vec3_across(vec3_t v, vec3_t direction, uint32_t *saturations) {
    const num_t along = vec3_dot(v, direction, saturations);
    return (vec3_t){.x = num_subtract(v.x, num_mul(along, direction.x, saturations), saturations),
                    .y = num_subtract(v.y, num_mul(along, direction.y, saturations), saturations),
                    .z = num_subtract(v.z, num_mul(along, direction.z, saturations), saturations)};
}

/* Length of v. In Q9.22 it saturates at the largest number. */
static inline num_t vec3_length(vec3_t v) {
    uint32_t ignored = 0;
    return vec3_is_large(v) ? num_mul(num_root(vec3_square(vec3_quarter(v))), NUM(4), &ignored)
                            : num_root(vec3_square(v));
}

#endif
