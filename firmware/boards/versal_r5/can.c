/* The CAN FD controller 0 of the Versal low-power domain, polled: receive FIFO 0 of 64 frames, 32 transmit buffers. */
#include "../common/board.h"
#include "../common/dlc.h"
#include "canfd_registers.h"
#include "protocol.h"

/* From a CAN clock of 80 MHz. Arbitration 1 Mbit/s: 80 quanta, sample point 80 %. Data phase 5 Mbit/s: 16 quanta, 75 %.
 * Registers hold each value minus one. */
enum {
    ARBITRATION_BEFORE = 63,
    ARBITRATION_AFTER = 16,
    ARBITRATION_JUMP = 16,
    DATA_BEFORE = 11,
    DATA_AFTER = 4,
    DATA_JUMP = 4,
    DATA_DELAY_OFFSET = 12 /* second sample point: after the measured loop delay, in CAN clocks */
};

enum { FIFO_READ_INDEX = 0x3Fu, FIFO_FILL_SHIFT = 8, FIFO_FILL = 0x7Fu, ID_SHIFT = 21, DLC_SHIFT = 28 };

#define STANDARD_ID_MASK 0x7FFu

static bool stuck;

static void set_filters(void) {
    canfd_write(CAN_AFR, 0);
    for (uint32_t slot = 0; slot < (uint32_t)PROTOCOL_RECEIVE_COUNT; ++slot) {
        /* Remote requests with these ids pass the filter, so that the guard can count them. */
        canfd_write(CAN_AFMR(slot), (STANDARD_ID_MASK << ID_SHIFT) | CAN_ID_IDE);
        canfd_write(CAN_AFIR(slot), (uint32_t)protocol_receive[slot].id << ID_SHIFT);
    }
    /* Frames of another guard: this one must detect it. */
    const uint32_t stop = protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id;
    canfd_write(CAN_AFMR(PROTOCOL_RECEIVE_COUNT), (STANDARD_ID_MASK << ID_SHIFT) | CAN_ID_IDE);
    canfd_write(CAN_AFIR(PROTOCOL_RECEIVE_COUNT), stop << ID_SHIFT);
    canfd_write(CAN_AFR, (2u << PROTOCOL_RECEIVE_COUNT) - 1u);
}

void can_init(wire_format_t format) {
    (void)format; /* the controller receives both; the guard refuses and counts frames of the wrong format */
    canfd_write(CAN_SRR, CAN_SRR_SRST);
    canfd_write(CAN_SRR, 0);
    canfd_write(CAN_BRPR, 0);
    canfd_write(CAN_BTR, ((ARBITRATION_JUMP - 1u) << 16) | ((ARBITRATION_AFTER - 1u) << 8) | (ARBITRATION_BEFORE - 1u));
    canfd_write(CAN_DPBRPR, CAN_DPBRPR_TDC | (DATA_DELAY_OFFSET << 8));
    canfd_write(CAN_DPBTR, ((DATA_JUMP - 1u) << 16) | ((DATA_AFTER - 1u) << 8) | (DATA_BEFORE - 1u));
    canfd_write(CAN_MSR, 0);
    set_filters();
    canfd_write(CAN_ICR, UINT32_MAX);
    canfd_write(CAN_SRR, CAN_SRR_CEN);
}

static uint8_t flags_of(uint32_t id_word, uint32_t dlc_word) {
    uint32_t flags = 0;
    flags |= ((dlc_word & CAN_DLC_FDF) != 0u) ? (uint32_t)CAN_FRAME_FD : 0u;
    flags |= ((dlc_word & CAN_DLC_BRS) != 0u) ? (uint32_t)CAN_FRAME_BRS : 0u;
    flags |= ((id_word & CAN_ID_IDE) != 0u) ? (uint32_t)CAN_FRAME_EXTENDED : 0u;
    const bool remote = ((id_word & CAN_ID_RTR) != 0u) && ((dlc_word & CAN_DLC_FDF) == 0u);
    flags |= remote ? (uint32_t)CAN_FRAME_REMOTE : 0u;
    return (uint8_t)flags;
}

bool can_receive(can_frame_t *frame) {
    const uint32_t fifo = canfd_read(CAN_FSR);
    if (((fifo >> FIFO_FILL_SHIFT) & FIFO_FILL) == 0u) {
        return false;
    }
    const uint32_t buffer = CAN_RX_BUFFER(fifo & FIFO_READ_INDEX);
    const uint32_t id_word = canfd_read(buffer);
    const uint32_t dlc_word = canfd_read(buffer + 4u);
    *frame = (can_frame_t){.id = id_word >> ID_SHIFT, .flags = flags_of(id_word, dlc_word)};
    frame->length = dlc_length(dlc_word >> DLC_SHIFT, (frame->flags & CAN_FRAME_FD) != 0u);
    for (uint32_t i = 0; (i < frame->length) && (i < CAN_FRAME_DATA_LENGTH); ++i) {
        const uint32_t word = canfd_read(buffer + 8u + (i & ~3u));
        frame->data[i] = (uint8_t)(word >> (24u - 8u * (i & 3u)));
    }
    canfd_write(CAN_FSR, CAN_FSR_IRI);
    return true;
}

static void fill(uint32_t buffer, const can_frame_t *frame) {
    uint32_t dlc = (uint32_t)frame->length << DLC_SHIFT;
    dlc |= ((frame->flags & CAN_FRAME_FD) != 0u) ? (uint32_t)CAN_DLC_FDF : 0u;
    dlc |= ((frame->flags & CAN_FRAME_BRS) != 0u) ? (uint32_t)CAN_DLC_BRS : 0u;
    canfd_write(buffer, frame->id << ID_SHIFT);
    canfd_write(buffer + 4u, dlc);
    for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; i += 4u) {
        canfd_write(buffer + 8u + i, ((uint32_t)frame->data[i] << 24) | ((uint32_t)frame->data[i + 1u] << 16) |
                                         ((uint32_t)frame->data[i + 2u] << 8) | (uint32_t)frame->data[i + 3u]);
    }
}

bool can_answer(const can_frame_t frames[], uint32_t count) {
    const uint32_t pending = canfd_read(CAN_TRR);
    if (pending != 0u) {
        canfd_write(CAN_TCR, pending);
        stuck = true;
    }
    /* A cancelled buffer is free when its bit is clear. Until then the following buffers are used. */
    uint32_t buffer = 0;
    bool all = true;
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t busy = canfd_read(CAN_TRR);
        while ((buffer < 32u) && ((busy & (1u << buffer)) != 0u)) {
            ++buffer;
        }
        if (buffer == 32u) {
            stuck = true;
            all = false;
            break;
        }
        fill(CAN_TX_BUFFER(buffer), &frames[i]);
        canfd_write(CAN_TRR, 1u << buffer);
        ++buffer;
    }
    return all;
}

uint32_t can_faults(void) {
    const uint32_t status = canfd_read(CAN_ISR);
    uint32_t faults = stuck ? (uint32_t)CAN_FAULT_STUCK : 0u;
    stuck = false;
    if ((status & CAN_ISR_RXFOFLW) != 0u) {
        canfd_write(CAN_ICR, CAN_ISR_RXFOFLW);
        faults |= CAN_FAULT_OVERFLOW;
    }
    if ((status & CAN_ISR_BSOFF) != 0u) {
        canfd_write(CAN_ICR, CAN_ISR_BSOFF);
        canfd_write(CAN_MSR, CAN_MSR_SBR);
        faults |= CAN_FAULT_OFF;
    }
    return faults;
}
