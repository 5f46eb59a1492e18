/* fdcan_registers: FDCAN1 of the STM32G4 and its message RAM (RM0440 rev 8, chapter 44: registers 44.4, RAM 44.3.6).
 *
 * The driver uses these four functions only, so that a test can replace them by a model of the controller.
 */
#ifndef TAUPERP_STM32G4_FDCAN_REGISTERS_H
#define TAUPERP_STM32G4_FDCAN_REGISTERS_H

#include <stdint.h>

#ifdef FDCAN_MODEL
uint32_t fdcan_read(uint32_t offset);
void fdcan_write(uint32_t offset, uint32_t value);
uint32_t fdcan_ram_read(uint32_t offset);
void fdcan_ram_write(uint32_t offset, uint32_t value);
#else
#define FDCAN1_BASE     0x40006400u
#define FDCAN1_RAM_BASE 0x4000A400u
static inline uint32_t fdcan_read(uint32_t offset) {
    return *(volatile uint32_t *)(FDCAN1_BASE + offset);
}
static inline void fdcan_write(uint32_t offset, uint32_t value) {
    *(volatile uint32_t *)(FDCAN1_BASE + offset) = value;
}
static inline uint32_t fdcan_ram_read(uint32_t offset) {
    return *(volatile uint32_t *)(FDCAN1_RAM_BASE + offset);
}
static inline void fdcan_ram_write(uint32_t offset, uint32_t value) {
    *(volatile uint32_t *)(FDCAN1_RAM_BASE + offset) = value;
}
#endif

/* Register offsets. A register marked * can be written only while CCCR.INIT and CCCR.CCE are set. */
enum {
    FDCAN_DBTP = 0x00C,  /* * data phase */
    FDCAN_CCCR = 0x018,  /* control; FDOE and BRSE are * */
    FDCAN_NBTP = 0x01C,  /* * arbitration phase */
    FDCAN_PSR = 0x044,   /* protocol status */
    FDCAN_TDCR = 0x048,  /* * transmitter delay compensation */
    FDCAN_IR = 0x050,    /* interrupt flags: sticky, cleared by writing a one */
    FDCAN_RXGFC = 0x080, /* * filters */
    FDCAN_RXF0S = 0x090, /* receive FIFO status */
    FDCAN_RXF0A = 0x094, /* acknowledge up to this element */
    FDCAN_RXF1S = 0x098,
    FDCAN_RXF1A = 0x09C,
    FDCAN_TXBC = 0x0C0,  /* * transmit buffers */
    FDCAN_TXFQS = 0x0C4, /* queue status */
    FDCAN_TXBRP = 0x0C8, /* requests pending */
    FDCAN_TXBAR = 0x0CC, /* add requests */
    FDCAN_TXBCR = 0x0D0  /* cancel requests */
};

enum {
    CCCR_INIT = 1u << 0,
    CCCR_CCE = 1u << 1,
    CCCR_FDOE = 1u << 8,
    CCCR_BRSE = 1u << 9,
    DBTP_TDC = 1u << 23,
    PSR_BO = 1u << 7,
    IR_RF0L = 1u << 2, /* FIFO 0 has lost a frame */
    IR_RF1L = 1u << 5,
    IR_BO = 1u << 19,
    RXGFC_ANFE_REJECT = 2u << 2, /* 29-bit ids that match no filter */
    RXGFC_ANFS_REJECT = 2u << 4, /* 11-bit ids */
    TXBC_TFQM = 1u << 24,        /* a queue: lowest id first */
    TXFQS_TFQF = 1u << 21        /* queue full */
};

enum {
    RXGFC_LSS_SHIFT = 16,
    FIFO_FILL = 0xFu,
    FIFO_GET_SHIFT = 8,
    FIFO_GET = 3u,
    TXFQS_PUT_SHIFT = 16,
    TXFQS_PUT = 3u
};

/* Offsets in FDCAN1's part of the message RAM. */
enum {
    RAM_FILTERS = 0x000, /* 28 words, one per filter for 11-bit ids */
    RAM_FIFO_0 = 0x0B0,  /* 3 elements */
    RAM_FIFO_1 = 0x188,
    RAM_BUFFERS = 0x278, /* 3 elements */
    RAM_ELEMENT = 72     /* bytes: two words of header, 64 of data */
};

/* Header words of an element, the same for reception and transmission. */
enum { ELEMENT_XTD = 1u << 30, ELEMENT_RTR = 1u << 29, ELEMENT_FDF = 1u << 21, ELEMENT_BRS = 1u << 20 };

enum { ELEMENT_ID_SHIFT = 18, ELEMENT_ID = 0x7FF, ELEMENT_DLC_SHIFT = 16 };

#define FILTER_DUAL_ID (1u << 30) /* two ids */
#define FILTER_FIFO_0  (1u << 27)
#define FILTER_FIFO_1  (2u << 27)

#endif
