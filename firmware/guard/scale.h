/* scale: converts raw signal integers to num_t and back, with the same bits on every target.
 *
 * tools/dbc2c writes each SCALE from the factor of a signal: the factor in float32; factor * 2^(22 + shift) rounded to
 * an integer of 31 bits; and its reciprocal, which is a whole number for every factor of this wire. Float: one IEEE
 * multiplication each way. Q9.22: one 32 x 32 -> 64 bit product, halves away from zero; within one step (2.4e-7) of the
 * exact value for every 16-bit raw. Cost: a few instructions each.
 */
#ifndef TAUPERP_SCALE_H
#define TAUPERP_SCALE_H

#include "num.h"

typedef struct {
#ifdef TAUPERP_FIXED
    int32_t multiplier;
    uint32_t shift;
#else
    float factor;
#endif
    int32_t per_unit;
} scale_t;

#ifdef TAUPERP_FIXED
#define SCALE(factor, multiplier, shift, per_unit) ((scale_t){(multiplier), (shift), (per_unit)})
#else
#define SCALE(factor, multiplier, shift, per_unit) ((scale_t){(factor), (per_unit)})
#endif

#ifdef TAUPERP_FIXED
/* value / 2^shift, halves away from zero. No negative number is shifted: C leaves its result to the compiler. */
static inline int64_t scale_round(int64_t value, uint32_t shift) {
    const int64_t half = (int64_t)1 << (shift - 1u);
    return (value < 0) ? -((half - value) >> shift) : ((value + half) >> shift);
}
#endif

/* Physical value of `raw`, -32768 to 65535. In Q9.22 it must be within +-511 units. */
static inline num_t scale_to_num(int32_t raw, scale_t scale) {
#ifdef TAUPERP_FIXED
    const int64_t product = (int64_t)raw * scale.multiplier;
    return (num_t)scale_round(product, scale.shift);
#else
    return (num_t)raw * scale.factor;
#endif
}

/* Nearest raw of `value`, halves away from zero, clamped to [min, max] (min <= max). For values that the guard
 * reports, never for those that it decides on. NaN gives min. */
static inline int32_t scale_to_raw(num_t value, scale_t scale, int32_t min, int32_t max) {
#ifdef TAUPERP_FIXED
    const int64_t raw = scale_round((int64_t)value * scale.per_unit, 22u);
    return (raw < min) ? min : ((raw > max) ? max : (int32_t)raw);
#else
    const float raw = value * (float)scale.per_unit;
    if (!(raw > (float)min)) {
        return min;
    }
    if (raw >= (float)max) {
        return max;
    }
    return (int32_t)((raw < 0.0f) ? (raw - 0.5f) : (raw + 0.5f));
#endif
}

#endif
