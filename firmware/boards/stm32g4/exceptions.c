#include "exceptions.h"

#include "board.h"
#include "log.h"
#include "registers.h"

#define RECORD_MAGIC 0x544C4146u /* "FALT"; after power-on RAM contains arbitrary values */

typedef struct {
    uint32_t magic;
    uint32_t magic_inverted;
    uint32_t exception; /* number, Armv7-M ARM B1.5.2 */
    uint32_t status;    /* CFSR */
    uint32_t address;   /* BFAR */
} record_t;

__attribute__((section(".noinit"))) static record_t record;

_Noreturn void fault_stop(void) {
    permission_withdraw();
    uint32_t exception;
    __asm volatile("mrs %0, ipsr" : "=r"(exception));
    record = (record_t){.magic = RECORD_MAGIC,
                        .magic_inverted = ~RECORD_MAGIC,
                        .exception = exception,
                        .status = SCB_CFSR,
                        .address = SCB_BFAR};
    board_halt();
}

bool fault_log_recorded(void) {
    const bool recorded = (record.magic == RECORD_MAGIC) && (record.magic_inverted == ~RECORD_MAGIC);
    if (recorded) {
        log_text("before this start: exception ");
        log_number(record.exception);
        log_text(" status ");
        log_hex(record.status, 8u);
        log_text(" address ");
        log_hex(record.address, 8u);
        log_text("\n");
    }
    record.magic = 0;
    return recorded;
}
