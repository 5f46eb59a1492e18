/* raw_stub: scale_to_raw as a stub with any value in its range. proof_num.c shows the function itself. */
#ifndef TAUPERP_RAW_STUB_H
#define TAUPERP_RAW_STUB_H

#include "proof.h"
#include "scale.h"

static inline int32_t stub_raw(scale_t scale, int32_t min, int32_t max) {
    int32_t raw;
    HOLDS((scale.per_unit >= 1) && (scale.per_unit <= 1000000) && (min <= max), "the precondition of scale_to_raw");
    ASSUME((raw >= min) && (raw <= max));
    return raw;
}

#define scale_to_raw(value, scale, min, max) ((void)(value), stub_raw((scale), (min), (max)))

#endif
