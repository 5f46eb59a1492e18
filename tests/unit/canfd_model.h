/* canfd_model: the Versal's CAN FD controller by its registers (PG223), and a bus. An access that the manual
 * forbids fails the test: timing written while the controller is on the bus, a filter written while it is in use, a
 * buffer read without a frame or filled while its request is pending. */
#ifndef CANFD_MODEL_H
#define CANFD_MODEL_H

#include <stdbool.h>
#include <string.h>

#define CANFD_MODEL
#include "../../firmware/boards/versal_r5/can.c"

#include "unity.h"

enum { FIFO_DEPTH = 64, TX_BUFFERS = 32, FILTERS = 32, WORDS = 18, SENT_MAX = 64 };

static struct {
    bool on_bus, bus_off;
    bool stalled;         /* no acknowledgement: nothing is sent */
    uint32_t on_the_wire; /* buffer that can no longer be cancelled, as a bit */
    uint32_t brpr, btr, dpbrpr, dpbtr, isr, pending, filters;
    uint32_t mask[FILTERS], id[FILTERS];
    uint32_t fifo[FIFO_DEPTH][WORDS], get, fill;
    uint32_t buffer[TX_BUFFERS][WORDS];
    can_frame_t sent[SENT_MAX];
    uint32_t sent_count;
} model;

static bool in(uint32_t offset, uint32_t begin, uint32_t stride, uint32_t count) {
    return (offset >= begin) && (offset < (begin + stride * count)) && ((offset % 4u) == 0u);
}

uint32_t canfd_read(uint32_t offset) {
    if (in(offset, CAN_RX_BUFFER(0u), 0x48u, FIFO_DEPTH)) {
        const uint32_t element = (offset - CAN_RX_BUFFER(0u)) / 0x48u;
        TEST_ASSERT_TRUE_MESSAGE((model.fill > 0u) && (element == model.get), "read of an element without a frame");
        return model.fifo[element][((offset - CAN_RX_BUFFER(0u)) % 0x48u) / 4u];
    }
    switch (offset) {
    case CAN_TRR:
        return model.pending;
    case CAN_ISR:
        return model.isr;
    case CAN_FSR:
        return model.get | (model.fill << 8);
    default:
        TEST_FAIL_MESSAGE("read of a register that the model does not have");
        return 0;
    }
}

static can_frame_t buffered(uint32_t number) {
    const uint32_t *const word = model.buffer[number];
    can_frame_t frame = {.id = word[0] >> 21, .length = (uint8_t)(word[1] >> 28)};
    frame.flags = (uint8_t)((((word[1] & (1u << 27)) != 0u) ? CAN_FRAME_FD : 0u) |
                            (((word[1] & (1u << 26)) != 0u) ? CAN_FRAME_BRS : 0u));
    for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; ++i) {
        frame.data[i] = (uint8_t)(word[2u + i / 4u] >> (24u - 8u * (i % 4u)));
    }
    return frame;
}

/* The bus is free for one frame after the other, the lowest id first. */
static void bus_transmit(void) {
    while ((model.pending != 0u) && model.on_bus && !model.bus_off && !model.stalled) {
        uint32_t best = TX_BUFFERS;
        for (uint32_t b = 0; b < TX_BUFFERS; ++b) {
            if (((model.pending & (1u << b)) != 0u) && ((best == TX_BUFFERS) || (buffered(b).id < buffered(best).id))) {
                best = b;
            }
        }
        TEST_ASSERT_TRUE(model.sent_count < SENT_MAX);
        model.sent[model.sent_count] = buffered(best);
        ++model.sent_count;
        model.pending &= ~(1u << best);
    }
}

static void write_timing(uint32_t *target, uint32_t value) {
    TEST_ASSERT_FALSE_MESSAGE(model.on_bus, "timing written while on the bus");
    *target = value;
}

static void write_control(uint32_t value) {
    if ((value & (uint32_t)CAN_SRR_SRST) != 0u) {
        memset(&model, 0, sizeof(model));
    } else {
        model.on_bus = (value & (uint32_t)CAN_SRR_CEN) != 0u;
    }
}

void canfd_write(uint32_t offset, uint32_t value) {
    if (in(offset, CAN_TX_BUFFER(0u), 0x48u, TX_BUFFERS)) {
        const uint32_t number = (offset - CAN_TX_BUFFER(0u)) / 0x48u;
        TEST_ASSERT_EQUAL_MESSAGE(0, model.pending & (1u << number), "write to a buffer that is pending");
        model.buffer[number][((offset - CAN_TX_BUFFER(0u)) % 0x48u) / 4u] = value;
        return;
    }
    if (in(offset, CAN_AFMR(0u), 8u, FILTERS)) {
        const uint32_t number = (offset - CAN_AFMR(0u)) / 8u;
        TEST_ASSERT_EQUAL_MESSAGE(0, model.filters & (1u << number), "write to a filter in use");
        *((((offset - CAN_AFMR(0u)) % 8u) == 0u) ? &model.mask[number] : &model.id[number]) = value;
        return;
    }
    switch (offset) {
    case CAN_SRR:
        write_control(value);
        break;
    case CAN_MSR:
        if ((value & (uint32_t)CAN_MSR_SBR) != 0u) {
            model.bus_off = false; /* after 128 times 11 recessive bits, in zero time here */
        }
        break;
    case CAN_BRPR:
        write_timing(&model.brpr, value);
        break;
    case CAN_BTR:
        write_timing(&model.btr, value);
        break;
    case CAN_DPBRPR:
        write_timing(&model.dpbrpr, value);
        break;
    case CAN_DPBTR:
        write_timing(&model.dpbtr, value);
        break;
    case CAN_ICR:
        model.isr &= ~value;
        break;
    case CAN_TRR:
        TEST_ASSERT_TRUE_MESSAGE(model.on_bus, "a request off the bus is ignored");
        model.pending |= value;
        break;
    case CAN_TCR:
        model.pending &= ~value | model.on_the_wire;
        break;
    case CAN_AFR:
        model.filters = value;
        break;
    case CAN_FSR:
        TEST_ASSERT_EQUAL_HEX32(CAN_FSR_IRI, value);
        TEST_ASSERT_TRUE_MESSAGE(model.fill > 0u, "done with an element of an empty FIFO");
        model.get = (model.get + 1u) % FIFO_DEPTH;
        --model.fill;
        break;
    default:
        TEST_FAIL_MESSAGE("write to a register that the model does not have");
        break;
    }
}

/* A frame of another node: a filter puts it into the FIFO, or it is dropped. `length_code` is its DLC. */
static void bus_receive(const can_frame_t *frame, uint32_t length_code) {
    const bool extended = (frame->flags & CAN_FRAME_EXTENDED) != 0u;
    uint32_t word = extended ? ((frame->id >> 18) << 21) | ((frame->id & 0x3FFFFu) << 1) : (frame->id << 21);
    word |= extended ? (3u << 19) : 0u; /* IDE, and SRR in the place of RTR */
    word |= ((frame->flags & CAN_FRAME_REMOTE) != 0u) ? (extended ? 1u : (1u << 20)) : 0u;
    bool passes = false;
    for (uint32_t i = 0; i < FILTERS; ++i) {
        const bool used = (model.filters & (1u << i)) != 0u;
        passes = passes || (used && (((word ^ model.id[i]) & model.mask[i]) == 0u));
    }
    if (!passes || !model.on_bus || model.bus_off) {
        return;
    }
    if (model.fill == FIFO_DEPTH) {
        model.isr |= (uint32_t)CAN_ISR_RXFOFLW;
        return;
    }
    uint32_t *const element = model.fifo[(model.get + model.fill) % FIFO_DEPTH];
    element[0] = word;
    element[1] = (length_code << 28) | (((frame->flags & CAN_FRAME_FD) != 0u) ? (1u << 27) : 0u) |
                 (((frame->flags & CAN_FRAME_BRS) != 0u) ? (1u << 26) : 0u) | 0xABCDu; /* and a time stamp */
    for (uint32_t i = 0; i < 4u; ++i) {
        element[2] = (element[2] << 8) | frame->data[i];
        element[3] = (element[3] << 8) | frame->data[i + 4u];
    }
    ++model.fill;
}

static void bus_goes_off(void) {
    model.bus_off = true;
    model.isr |= (uint32_t)CAN_ISR_BSOFF;
}

#endif
