#include "identity.h"

#include "board.h"
#include "log.h"
#include "protocol.h"
#include "version.h"

__attribute__((section(".tauperp_version"), used)) const identity_t identity = {
    .magic = "TAUPERP",
    .format = IDENTITY_FORMAT,
    .version = (TAUPERP_VERSION_MAJOR << 16) | (TAUPERP_VERSION_MINOR << 8) | TAUPERP_VERSION_PATCH,
    .build = TAUPERP_BUILD_ID,
    .config_crc = TAUPERP_CONFIG_CRC,
    .wire_crc = PROTOCOL_WIRE_CRC,
    .numeric = NUM_NUMERIC,
    .board = TAUPERP_BOARD,
    .variant = (uint32_t)BOARD_VARIANT,
};

void identity_log(void) {
    log_text("tauperp ");
    log_number(TAUPERP_VERSION_MAJOR);
    log_text(".");
    log_number(TAUPERP_VERSION_MINOR);
    log_text(".");
    log_number(TAUPERP_VERSION_PATCH);
    log_text(" on ");
    log_text(identity.board);
    log_text((BOARD_VARIANT == GUARD_VARIANT_LOCKSTEP)   ? " in lockstep, not for a robot"
             : (BOARD_VARIANT == GUARD_VARIANT_EMULATOR) ? " for the emulator, not for a robot"
                                                         : "");
    log_text(", build ");
    log_hex(identity.build, 8u);
    log_text(", configuration ");
    log_hex(identity.config_crc, 8u);
    log_text("\n");
}
