/* fdcan_model: the STM32G4's FDCAN1 by its registers (RM0440 rev 8, chapter 44), and a bus. An access that the
 * manual forbids fails the test: a protected register written outside configuration, a read or acknowledgement of an
 * element without a frame, a buffer filled while its request is pending. */
#ifndef FDCAN_MODEL_H
#define FDCAN_MODEL_H

#include <stdbool.h>
#include <string.h>

#define FDCAN_MODEL
#include "../../firmware/boards/stm32g4/fdcan.c"

#include "unity.h"

enum { FIFO_DEPTH = 3, BUFFER_COUNT = 3, RAM_BYTES = 0x350, SENT_MAX = 16 };

typedef struct {
    uint32_t get, fill;
} model_fifo_t;

static struct {
    uint32_t control, dbtp, nbtp, tdcr, rxgfc, txbc, flags, pending;
    bool bus_off;
    bool absent;          /* without a clock every register reads zero */
    bool stalled;         /* no acknowledgement: nothing is sent */
    uint32_t on_the_wire; /* buffer that can no longer be cancelled, as a bit */
    model_fifo_t fifo[2];
    uint8_t ram[RAM_BYTES];
    can_frame_t sent[SENT_MAX];
    uint32_t sent_count;
} model;

static uint32_t ram_word(uint32_t offset) {
    uint32_t word;
    TEST_ASSERT_TRUE((offset % 4u == 0u) && (offset + 4u <= RAM_BYTES));
    memcpy(&word, &model.ram[offset], 4u);
    return word;
}

uint32_t fdcan_ram_read(uint32_t offset) {
    for (uint32_t f = 0; f < 2u; ++f) {
        const uint32_t base = (f == 0u) ? RAM_FIFO_0 : RAM_FIFO_1;
        if ((offset >= base) && (offset < base + FIFO_DEPTH * RAM_ELEMENT)) {
            const uint32_t behind = ((offset - base) / RAM_ELEMENT + FIFO_DEPTH - model.fifo[f].get) % FIFO_DEPTH;
            TEST_ASSERT_TRUE_MESSAGE(behind < model.fifo[f].fill, "read of an element without a frame");
        }
    }
    return ram_word(offset);
}

void fdcan_ram_write(uint32_t offset, uint32_t value) {
    TEST_ASSERT_TRUE((offset % 4u == 0u) && (offset + 4u <= RAM_BYTES));
    if (offset >= RAM_BUFFERS) {
        const uint32_t buffer = (offset - RAM_BUFFERS) / RAM_ELEMENT;
        TEST_ASSERT_EQUAL_MESSAGE(0, model.pending & (1u << buffer), "write to a buffer that is pending");
    }
    memcpy(&model.ram[offset], &value, 4u);
}

static uint32_t free_buffer(void) {
    uint32_t buffer = 0;
    while ((buffer < BUFFER_COUNT) && ((model.pending & (1u << buffer)) != 0u)) {
        ++buffer;
    }
    return buffer;
}

static uint32_t fifo_status(uint32_t f) {
    return model.fifo[f].fill | (model.fifo[f].get << 8) | ((model.fifo[f].fill == FIFO_DEPTH) ? (1u << 24) : 0u);
}

uint32_t fdcan_read(uint32_t offset) {
    if (model.absent) {
        return 0;
    }
    switch (offset) {
    case FDCAN_CCCR:
        return model.control;
    case FDCAN_PSR:
        return model.bus_off ? PSR_BO : 0u;
    case FDCAN_IR:
        return model.flags;
    case FDCAN_RXF0S:
        return fifo_status(0);
    case FDCAN_RXF1S:
        return fifo_status(1);
    case FDCAN_TXBRP:
        return model.pending;
    case FDCAN_TXFQS:
        return (free_buffer() == BUFFER_COUNT) ? (uint32_t)TXFQS_TFQF : (free_buffer() << 16);
    default:
        TEST_FAIL_MESSAGE("read of a register that the model does not have");
        return 0;
    }
}

static can_frame_t buffered(uint32_t buffer) {
    const uint32_t element = RAM_BUFFERS + buffer * RAM_ELEMENT;
    const uint32_t id_word = ram_word(element);
    const uint32_t dlc_word = ram_word(element + 4u);
    can_frame_t frame = {.id = (id_word >> 18) & 0x7FFu, .length = (uint8_t)((dlc_word >> 16) & 0xFu)};
    const bool fd = ((model.control & CCCR_FDOE) != 0u) && ((dlc_word & (1u << 21)) != 0u);
    const bool brs = fd && ((model.control & CCCR_BRSE) != 0u) && ((dlc_word & (1u << 20)) != 0u);
    frame.flags = (uint8_t)((fd ? CAN_FRAME_FD : 0u) | (brs ? CAN_FRAME_BRS : 0u));
    memcpy(frame.data, &model.ram[element + 8u], 8u);
    return frame;
}

static bool goes_before(uint32_t buffer, uint32_t other) {
    const bool queue = (model.txbc & TXBC_TFQM) != 0u; /* otherwise they are sent in the order of their numbers */
    return queue ? (buffered(buffer).id < buffered(other).id) : (buffer < other);
}

/* The bus is free for one frame after the other. */
static void bus_transmit(void) {
    while ((model.pending != 0u) && ((model.control & CCCR_INIT) == 0u) && !model.stalled) {
        uint32_t best = BUFFER_COUNT;
        for (uint32_t b = 0; b < BUFFER_COUNT; ++b) {
            if (((model.pending & (1u << b)) != 0u) && ((best == BUFFER_COUNT) || goes_before(b, best))) {
                best = b;
            }
        }
        TEST_ASSERT_TRUE(model.sent_count < SENT_MAX);
        model.sent[model.sent_count] = buffered(best);
        ++model.sent_count;
        model.pending &= ~(1u << best);
    }
}

static void write_control(uint32_t value) {
    const uint32_t both = CCCR_INIT | CCCR_CCE;
    const bool configuring = (model.control & both) == both;
    if (!configuring) {
        /* The write that clears INIT keeps both. Their later state does not matter here. */
        TEST_ASSERT_EQUAL_MESSAGE(0, (value ^ model.control) & (CCCR_FDOE | CCCR_BRSE) & value,
                                  "FDOE or BRSE set outside of configuration");
        TEST_ASSERT_TRUE_MESSAGE(((value & CCCR_CCE) == 0u) || ((model.control & CCCR_INIT) != 0u), "CCE without INIT");
    }
    model.control = value;
    if ((value & CCCR_INIT) == 0u) {
        model.control &= ~(uint32_t)CCCR_CCE;
        model.bus_off = false; /* after 128 times 11 recessive bits, in zero time here */
    }
}

static void write_protected(uint32_t *target, uint32_t value) {
    const uint32_t both = CCCR_INIT | CCCR_CCE;
    TEST_ASSERT_EQUAL_MESSAGE(both, model.control & both, "a protected register written outside of configuration");
    *target = value;
}

static void acknowledge(uint32_t f, uint32_t index) {
    model_fifo_t *const fifo = &model.fifo[f];
    TEST_ASSERT_TRUE_MESSAGE(fifo->fill > 0u, "acknowledgement of an empty FIFO");
    TEST_ASSERT_EQUAL_MESSAGE(fifo->get, index, "acknowledgement of another element");
    fifo->get = (fifo->get + 1u) % FIFO_DEPTH;
    --fifo->fill;
}

void fdcan_write(uint32_t offset, uint32_t value) {
    switch (offset) {
    case FDCAN_CCCR:
        write_control(value);
        break;
    case FDCAN_DBTP:
        write_protected(&model.dbtp, value);
        break;
    case FDCAN_NBTP:
        write_protected(&model.nbtp, value);
        break;
    case FDCAN_TDCR:
        write_protected(&model.tdcr, value);
        break;
    case FDCAN_RXGFC:
        write_protected(&model.rxgfc, value);
        break;
    case FDCAN_TXBC:
        write_protected(&model.txbc, value);
        break;
    case FDCAN_IR:
        model.flags &= ~value;
        break;
    case FDCAN_RXF0A:
        acknowledge(0, value);
        break;
    case FDCAN_RXF1A:
        acknowledge(1, value);
        break;
    case FDCAN_TXBAR:
        TEST_ASSERT_EQUAL_MESSAGE(0, model.control & CCCR_INIT, "a request in INIT is ignored");
        model.pending |= value;
        break;
    case FDCAN_TXBCR:
        model.pending &= ~value | model.on_the_wire;
        break;
    default:
        TEST_FAIL_MESSAGE("write to a register that the model does not have");
        break;
    }
}

/* A frame of another node: the filters put it into a FIFO, or it is dropped. `length_code` is its DLC. */
static void bus_receive(const can_frame_t *frame, uint32_t length_code) {
    if ((model.control & CCCR_INIT) != 0u) {
        return;
    }
    uint32_t target = 0; /* SFEC: 1 FIFO 0, 2 FIFO 1 */
    const uint32_t filters = (model.rxgfc >> 16) & 0x1Fu;
    for (uint32_t i = 0; (i < filters) && (target == 0u) && ((frame->flags & CAN_FRAME_EXTENDED) == 0u); ++i) {
        const uint32_t filter = ram_word(RAM_FILTERS + 4u * i);
        TEST_ASSERT_EQUAL_MESSAGE(1, filter >> 30, "only filters of two ids are modelled");
        if ((((filter >> 16) & 0x7FFu) == frame->id) || ((filter & 0x7FFu) == frame->id)) {
            target = (filter >> 27) & 7u;
        }
    }
    if (target == 0u) {
        const uint32_t shift = ((frame->flags & CAN_FRAME_EXTENDED) != 0u) ? 2u : 4u;
        if (((model.rxgfc >> shift) & 3u) >= 2u) {
            return;
        }
        target = 1u + ((model.rxgfc >> shift) & 3u);
    }
    model_fifo_t *const fifo = &model.fifo[target - 1u];
    if (fifo->fill == FIFO_DEPTH) {
        model.flags |= (target == 1u) ? IR_RF0L : IR_RF1L;
        return;
    }
    const uint32_t index = (fifo->get + fifo->fill) % FIFO_DEPTH;
    const uint32_t element = ((target == 1u) ? RAM_FIFO_0 : RAM_FIFO_1) + index * RAM_ELEMENT;
    const bool extended = (frame->flags & CAN_FRAME_EXTENDED) != 0u;
    uint32_t word = extended ? (frame->id | (1u << 30)) : (frame->id << 18);
    word |= ((frame->flags & CAN_FRAME_REMOTE) != 0u) ? (1u << 29) : 0u;
    memcpy(&model.ram[element], &word, 4u);
    word = length_code << 16;
    word |= ((frame->flags & CAN_FRAME_FD) != 0u) ? (1u << 21) : 0u;
    word |= ((frame->flags & CAN_FRAME_BRS) != 0u) ? (1u << 20) : 0u;
    memcpy(&model.ram[element + 4u], &word, 4u);
    memcpy(&model.ram[element + 8u], frame->data,
           (frame->length < 8u) ? frame->length : 8u); /* the rest does not change */
    ++fifo->fill;
}

static void bus_goes_off(void) {
    model.bus_off = true;
    model.control |= CCCR_INIT; /* set by the controller itself */
    model.flags |= IR_BO;
}

#endif
