/* report: tallies of instruction counts, and the lines that an image prints for tools/bench/bench.py:
 *
 *     count CASE STAGE MEAN WORST STATES        (STAGE "total" for the case itself)
 *     deficient CASE STATES                     whose basis has fewer directions than columns
 *     size NAME NUMBER
 *     agree PEER QUANTITY STATES PPM            (agree.c)
 */
#ifndef TAUPERP_BENCH_REPORT_H
#define TAUPERP_BENCH_REPORT_H

#include <stdint.h>

typedef struct {
    uint64_t sum;
    uint32_t worst;
    uint32_t count;
} tally_t;

void tally_add(tally_t *self, uint32_t instructions);

/* Sections of code, each from the start, or from the end of the previous one, to its own end. The cost of reading the
 * counter is subtracted. */
void stretch_init(void);
void stretch_begin(void);
uint32_t stretch_end(void);

void report_tally(const char *case_name, const char *stage, const tally_t *tally);
void report_deficient(const char *case_name, uint32_t states);
void report_size(const char *name, uint32_t number);
void report_agreement(const char *peer, const char *quantity, uint32_t states, uint32_t ppm);

#endif
