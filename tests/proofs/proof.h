/* proof: the macros of the harnesses that CBMC checks. A variable without a value has any value. */
#ifndef TAUPERP_PROOF_H
#define TAUPERP_PROOF_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* CBMC knows memcpy, not the builtin. */
#define __builtin_memcpy memcpy

#define ASSUME(condition) __CPROVER_assume(condition)

/* At the end of each harness. It must fail: if CBMC cannot reach it, the assumptions exclude every run. */
#define REACHED __CPROVER_assert(0, "reached")

#define HOLDS(condition, what) __CPROVER_assert(condition, what)

/* A harness and the code that it calls are one unit. */
#include "num_fixed.c"

#endif
