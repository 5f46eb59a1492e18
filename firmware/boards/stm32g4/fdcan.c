/* FDCAN1, polled. Frames for the whole robot go into FIFO 0: Sync, TaskCommand, GuardReset, and StopCommand, which can
 * only come from another guard. Joint readings go into FIFO 1. Each FIFO holds three frames. FIFO 0 is read first, so
 * that the readings of a cycle never overtake its Sync.
 */
#include "../common/board.h"
#include "../common/dlc.h"
#include "fdcan_registers.h"
#include "protocol.h"

/* From a kernel clock of 85 MHz. Arbitration 1 Mbit/s: 85 quanta, sample point 80 %. Data 5 Mbit/s: 17 quanta, 76 %.
 * Registers hold each value minus one. */
enum {
    ARBITRATION_BEFORE = 67,
    ARBITRATION_AFTER = 17,
    ARBITRATION_JUMP = 17,
    DATA_BEFORE = 12,
    DATA_AFTER = 4,
    DATA_JUMP = 4,
    DATA_DELAY_OFFSET = 13 /* second sample point: after the measured loop delay, in kernel clocks */
};

#define FILTER_COUNT (PROTOCOL_RECEIVE_COUNT + 1)
#define INIT_TRIES   100000u
#define ANSWER_TRIES 1000u /* register reads: a few us */

static bool stuck;
static bool dead; /* the controller did not answer at start: no frames, and the bus counts as down */

static void set_filters(void) {
    for (uint32_t slot = 0; slot < (uint32_t)PROTOCOL_RECEIVE_COUNT; ++slot) {
        const uint32_t id = protocol_receive[slot].id;
        const bool joint = protocol_receive[slot].kind == (uint8_t)PROTOCOL_KIND_JOINT_STATE;
        fdcan_ram_write(RAM_FILTERS + 4u * slot,
                        FILTER_DUAL_ID | (joint ? FILTER_FIFO_1 : FILTER_FIFO_0) | (id << 16) | id);
    }
    const uint32_t stop = protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id;
    fdcan_ram_write(RAM_FILTERS + 4u * (uint32_t)PROTOCOL_RECEIVE_COUNT,
                    FILTER_DUAL_ID | FILTER_FIFO_0 | (stop << 16) | stop);
    fdcan_write(FDCAN_RXGFC, ((uint32_t)FILTER_COUNT << RXGFC_LSS_SHIFT) | RXGFC_ANFE_REJECT | RXGFC_ANFS_REJECT);
}

static bool comes_to_init(void) {
    for (uint32_t tries = 0; tries < INIT_TRIES; ++tries) {
        if ((fdcan_read(FDCAN_CCCR) & CCCR_INIT) != 0u) {
            return true;
        }
    }
    return false;
}

void can_init(wire_format_t format) {
    stuck = false;
    fdcan_write(FDCAN_CCCR, CCCR_INIT);
    dead = !comes_to_init();
    if (dead) {
        return;
    }
    fdcan_write(FDCAN_CCCR, CCCR_INIT | CCCR_CCE);
    const uint32_t fd = (format == FORMAT_FD) ? (uint32_t)(CCCR_FDOE | CCCR_BRSE) : 0u;
    fdcan_write(FDCAN_CCCR, CCCR_INIT | CCCR_CCE | fd);
    fdcan_write(FDCAN_NBTP,
                ((ARBITRATION_JUMP - 1u) << 25) | ((ARBITRATION_BEFORE - 1u) << 8) | (ARBITRATION_AFTER - 1u));
    fdcan_write(FDCAN_DBTP, DBTP_TDC | ((DATA_BEFORE - 1u) << 8) | ((DATA_AFTER - 1u) << 4) | (DATA_JUMP - 1u));
    fdcan_write(FDCAN_TDCR, DATA_DELAY_OFFSET << 8);
    fdcan_write(FDCAN_TXBC, TXBC_TFQM);
    set_filters();
    fdcan_write(FDCAN_IR, UINT32_MAX);
    fdcan_write(FDCAN_CCCR, fd); /* join the bus after 11 recessive bits */
}

static void take(uint32_t element, can_frame_t *frame) {
    const uint32_t id_word = fdcan_ram_read(element);
    const uint32_t dlc_word = fdcan_ram_read(element + 4u);
    uint32_t flags = 0;
    flags |= ((dlc_word & ELEMENT_FDF) != 0u) ? (uint32_t)CAN_FRAME_FD : 0u;
    flags |= ((dlc_word & ELEMENT_BRS) != 0u) ? (uint32_t)CAN_FRAME_BRS : 0u;
    flags |= ((id_word & ELEMENT_XTD) != 0u) ? (uint32_t)CAN_FRAME_EXTENDED : 0u;
    flags |= ((id_word & ELEMENT_RTR) != 0u) ? (uint32_t)CAN_FRAME_REMOTE : 0u;
    *frame = (can_frame_t){.id = (id_word >> ELEMENT_ID_SHIFT) & ELEMENT_ID, .flags = (uint8_t)flags};
    frame->length = dlc_length(dlc_word >> ELEMENT_DLC_SHIFT, (flags & CAN_FRAME_FD) != 0u);
    for (uint32_t i = 0; (i < frame->length) && (i < CAN_FRAME_DATA_LENGTH); ++i) {
        frame->data[i] = (uint8_t)(fdcan_ram_read(element + 8u + (i & ~3u)) >> (8u * (i & 3u)));
    }
}

static bool receive_from(uint32_t status_register, uint32_t acknowledge_register, uint32_t ram, can_frame_t *frame) {
    const uint32_t status = fdcan_read(status_register);
    if ((status & FIFO_FILL) == 0u) {
        return false;
    }
    const uint32_t index = (status >> FIFO_GET_SHIFT) & FIFO_GET;
    take(ram + RAM_ELEMENT * index, frame);
    fdcan_write(acknowledge_register, index);
    return true;
}

bool can_receive(can_frame_t *frame) {
    return !dead && (receive_from(FDCAN_RXF0S, FDCAN_RXF0A, RAM_FIFO_0, frame) ||
                     receive_from(FDCAN_RXF1S, FDCAN_RXF1A, RAM_FIFO_1, frame));
}

static void fill(uint32_t element, const can_frame_t *frame) {
    uint32_t dlc_word = (uint32_t)frame->length << ELEMENT_DLC_SHIFT;
    dlc_word |= ((frame->flags & CAN_FRAME_FD) != 0u) ? (uint32_t)ELEMENT_FDF : 0u;
    dlc_word |= ((frame->flags & CAN_FRAME_BRS) != 0u) ? (uint32_t)ELEMENT_BRS : 0u;
    fdcan_ram_write(element, frame->id << ELEMENT_ID_SHIFT);
    fdcan_ram_write(element + 4u, dlc_word);
    for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; i += 4u) {
        fdcan_ram_write(element + 8u + i, (uint32_t)frame->data[i] | ((uint32_t)frame->data[i + 1u] << 8) |
                                              ((uint32_t)frame->data[i + 2u] << 16) |
                                              ((uint32_t)frame->data[i + 3u] << 24));
    }
}

/* A frame that is being sent cannot be cancelled. Two of the three buffers remain. */
bool can_answer(const can_frame_t frames[], uint32_t count) {
    if (dead) {
        return false;
    }
    const uint32_t pending = fdcan_read(FDCAN_TXBRP);
    if (pending != 0u) {
        fdcan_write(FDCAN_TXBCR, pending);
        stuck = true;
        for (uint32_t tries = 0; (tries < ANSWER_TRIES) && (fdcan_read(FDCAN_TXBRP) == pending); ++tries) {}
    }
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t status = fdcan_read(FDCAN_TXFQS);
        if ((status & TXFQS_TFQF) != 0u) {
            return false;
        }
        const uint32_t index = (status >> TXFQS_PUT_SHIFT) & TXFQS_PUT;
        fill(RAM_BUFFERS + RAM_ELEMENT * index, &frames[i]);
        fdcan_write(FDCAN_TXBAR, 1u << index);
    }
    return true;
}

uint32_t can_faults(void) {
    if (dead) {
        return CAN_FAULT_STUCK;
    }
    const uint32_t flags = fdcan_read(FDCAN_IR) & (uint32_t)(IR_RF0L | IR_RF1L | IR_BO);
    uint32_t faults = stuck ? (uint32_t)CAN_FAULT_STUCK : 0u;
    stuck = false;
    if (flags != 0u) {
        fdcan_write(FDCAN_IR, flags);
    }
    if ((flags & (uint32_t)(IR_RF0L | IR_RF1L)) != 0u) {
        faults |= CAN_FAULT_OVERFLOW;
    }
    if ((fdcan_read(FDCAN_PSR) & PSR_BO) != 0u) {
        faults |= CAN_FAULT_OFF;
        /* The hardware has entered INIT; leaving it starts the recovery (44.3.2). */
        const uint32_t control = fdcan_read(FDCAN_CCCR);
        if ((control & CCCR_INIT) != 0u) {
            fdcan_write(FDCAN_CCCR, control & ~(uint32_t)(CCCR_INIT | CCCR_CCE));
        }
    }
    return faults;
}
