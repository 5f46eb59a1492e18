#include "report.h"

#include "counter.h"
#include "semihosting.h"

static uint32_t started;
static uint32_t overhead;

void tally_add(tally_t *self, uint32_t instructions) {
    self->sum += instructions;
    self->worst = (instructions > self->worst) ? instructions : self->worst;
    ++self->count;
}

/* The same path at the start and the end, so that every section has the same overhead. */
__attribute__((noinline, noclone)) static uint32_t since_last(void) {
    const uint32_t now = counter_read();
    const uint32_t instructions = counter_instructions(started, now);
    started = now;
    return (instructions > overhead) ? (instructions - overhead) : 0u;
}

void stretch_begin(void) {
    (void)since_last();
}

uint32_t stretch_end(void) {
    return since_last();
}

void stretch_init(void) {
    counter_init();
    overhead = 0;
    stretch_begin();
    overhead = stretch_end();
}

static void write_number(uint32_t number) {
    char digits[11];
    uint32_t at = sizeof digits - 1u;
    digits[at] = '\0';
    do {
        --at;
        digits[at] = (char)('0' + (number % 10u));
        number /= 10u;
    } while (number > 0u);
    semihosting_write(&digits[at]);
}

static void write_field(const char *text) {
    semihosting_write(text);
    semihosting_write(" ");
}

static void write_number_field(uint32_t number) {
    write_number(number);
    semihosting_write(" ");
}

static void write_last_number(uint32_t number) {
    write_number(number);
    semihosting_write("\n");
}

void report_tally(const char *case_name, const char *stage, const tally_t *tally) {
    write_field("count");
    write_field(case_name);
    write_field(stage);
    write_number_field((tally->count > 0u) ? (uint32_t)((tally->sum + tally->count / 2u) / tally->count) : 0u);
    write_number_field(tally->worst);
    write_last_number(tally->count);
}

void report_deficient(const char *case_name, uint32_t states) {
    write_field("deficient");
    write_field(case_name);
    write_last_number(states);
}

void report_size(const char *name, uint32_t number) {
    write_field("size");
    write_field(name);
    write_last_number(number);
}

void report_agreement(const char *peer, const char *quantity, uint32_t states, uint32_t ppm) {
    write_field("agree");
    write_field(peer);
    write_field(quantity);
    write_number_field(states);
    write_last_number(ppm);
}
