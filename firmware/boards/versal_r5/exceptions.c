#include "exceptions.h"

#include "board.h"
#include "log.h"

#define RECORD_MAGIC 0x544C4146u /* "FALT"; after power-on RAM contains arbitrary values */

typedef struct {
    uint32_t magic;
    uint32_t magic_inverted;
    uint32_t kind; /* fault_kind_t */
    uint32_t return_address;
    uint32_t saved_status; /* SPSR */
    uint32_t fault_status; /* DFSR or IFSR */
    uint32_t fault_address;
} record_t;

__attribute__((section(".noinit"))) static record_t record;

static const char *const NAMES[FAULT_COUNT] = {
    "none", "undefined instruction", "supervisor call", "prefetch abort", "data abort", "interrupt", "fast interrupt"};

static void log_field(const char *name, uint32_t value) {
    log_text(name);
    log_hex(value, 8u);
}

static void log_record(const char *when) {
    log_text(when);
    log_text((record.kind < (uint32_t)FAULT_COUNT) ? NAMES[record.kind] : "?");
    log_field(" at ", record.return_address);
    log_field(" status ", record.fault_status);
    log_field(" address ", record.fault_address);
    log_field(" spsr ", record.saved_status);
    log_text("\n");
}

_Noreturn void fault_stop(fault_kind_t kind, uint32_t return_address, uint32_t saved_status) {
    permission_withdraw();
    record = (record_t){.magic = RECORD_MAGIC,
                        .magic_inverted = ~RECORD_MAGIC,
                        .kind = (uint32_t)kind,
                        .return_address = return_address,
                        .saved_status = saved_status};
    if (kind == FAULT_DATA_ABORT) {
        __asm volatile("mrc p15, 0, %0, c5, c0, 0" : "=r"(record.fault_status));
        __asm volatile("mrc p15, 0, %0, c6, c0, 0" : "=r"(record.fault_address));
    } else if (kind == FAULT_PREFETCH_ABORT) {
        __asm volatile("mrc p15, 0, %0, c5, c0, 1" : "=r"(record.fault_status));
        __asm volatile("mrc p15, 0, %0, c6, c0, 2" : "=r"(record.fault_address));
    } else {
        /* these have no address */
    }
    log_record("fault: ");
    log_flush();
    board_halt();
}

bool fault_log_recorded(void) {
    const bool recorded = (record.magic == RECORD_MAGIC) && (record.magic_inverted == ~RECORD_MAGIC);
    if (recorded) {
        log_record("before this start: ");
    }
    record.magic = 0;
    return recorded;
}
