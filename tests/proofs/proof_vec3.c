/* firmware/core/vec3.h: the cross product of any two vectors, also without a component below 64. proof_core.c shows the
 * other products. */
#include "num_sizes.h"

#include "vec3.h"

void proof_vec3_cross(void) {
    vec3_t a, b;
    uint32_t saturations;
    ASSUME((a.x >= -INT32_MAX) && (a.y >= -INT32_MAX) && (a.z >= -INT32_MAX));
    ASSUME((b.x >= -INT32_MAX) && (b.y >= -INT32_MAX) && (b.z >= -INT32_MAX));
    (void)vec3_cross(a, b, &saturations);
    REACHED;
}
