/* canfd_registers: the registers of CAN FD controller 0 of the AMD Versal low-power domain that this board uses (PG223,
 * CAN FD v3.0; AM012, Versal ACAP register reference).
 *
 * The driver uses these two functions only, so that a test can replace them by a model of the controller.
 */
#ifndef TAUPERP_VERSAL_R5_CANFD_REGISTERS_H
#define TAUPERP_VERSAL_R5_CANFD_REGISTERS_H

#include <stdint.h>

#ifdef CANFD_MODEL
uint32_t canfd_read(uint32_t offset);
void canfd_write(uint32_t offset, uint32_t value);
#else
#define CANFD0_BASE 0xFF060000u
static inline uint32_t canfd_read(uint32_t offset) {
    return *(volatile uint32_t *)(CANFD0_BASE + offset);
}
static inline void canfd_write(uint32_t offset, uint32_t value) {
    *(volatile uint32_t *)(CANFD0_BASE + offset) = value;
}
#endif

/* Register offsets. A register marked * can be written only while SRR.CEN is clear. */
enum {
    CAN_SRR = 0x000,    /* software reset, enable */
    CAN_MSR = 0x004,    /* mode select */
    CAN_BRPR = 0x008,   /* * arbitration phase prescaler */
    CAN_BTR = 0x00C,    /* * */
    CAN_ISR = 0x01C,    /* interrupt status: sticky, polled without an interrupt */
    CAN_ICR = 0x024,    /* writing a one clears the ISR bit */
    CAN_DPBRPR = 0x088, /* * data phase prescaler, transmitter delay compensation */
    CAN_DPBTR = 0x08C,  /* * */
    CAN_TRR = 0x090,    /* transmit request, one bit per buffer */
    CAN_TCR = 0x098,    /* cancel request */
    CAN_AFR = 0x0E0,    /* acceptance filters in use */
    CAN_FSR = 0x0E8     /* receive FIFO 0: read index, fill level, increment */
};

#define CAN_TX_BUFFER(n) (0x100u + 0x48u * (n)) /* id, dlc, 16 words of data, first byte in the highest bits */
#define CAN_AFMR(n)      (0xA00u + 8u * (n))    /* filter mask; write it and its id only while the filter is disabled */
#define CAN_AFIR(n)      (0xA04u + 8u * (n))    /* filter id */
#define CAN_RX_BUFFER(n) (0x2100u + 0x48u * (n))

enum {
    CAN_SRR_SRST = 1u << 0,
    CAN_SRR_CEN = 1u << 1,
    CAN_MSR_SBR = 1u << 6,     /* start the recovery from bus-off */
    CAN_ISR_RXFOFLW = 1u << 6, /* receive FIFO 0 has lost a frame */
    CAN_ISR_BSOFF = 1u << 9,
    CAN_FSR_IRI = 1u << 7, /* release the frame at the read index */
    CAN_DPBRPR_TDC = 1u << 16,
    CAN_ID_IDE = 1u << 19, /* 29-bit id */
    CAN_ID_RTR = 1u << 20, /* of a frame with an 11-bit id */
    CAN_DLC_BRS = 1u << 26,
    CAN_DLC_FDF = 1u << 27
};

#endif
