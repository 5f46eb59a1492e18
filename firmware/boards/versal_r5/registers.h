/* registers: of the AMD Versal low-power domain, as far as they are used here (AM012, Versal ACAP register reference;
 * CAN FD also PG223, CAN FD v3.0). */
#ifndef TAUPERP_VERSAL_R5_REGISTERS_H
#define TAUPERP_VERSAL_R5_REGISTERS_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))

#define UART0_BASE 0xFF000000u /* Arm PL011, DDI 0183 */
#define UART_DR    REGISTER(UART0_BASE + 0x00u)
#define UART_FR    REGISTER(UART0_BASE + 0x18u)
#define UART_IBRD  REGISTER(UART0_BASE + 0x24u)
#define UART_FBRD  REGISTER(UART0_BASE + 0x28u)
#define UART_LCR_H REGISTER(UART0_BASE + 0x2Cu)
#define UART_CR    REGISTER(UART0_BASE + 0x30u)

enum {
    UART_FR_TXFF = 1u << 5,   /* transmit FIFO full */
    UART_LCR_FEN = 1u << 4,   /* FIFOs on */
    UART_LCR_WLEN8 = 3u << 5, /* 8 bits, no parity, 1 stop bit */
    UART_CR_UARTEN = 1u << 0,
    UART_CR_TXE = 1u << 8
};

#define CAN0_BASE        0xFF060000u
#define CAN_SRR          REGISTER(CAN0_BASE + 0x00u) /* software reset, enable */
#define CAN_MSR          REGISTER(CAN0_BASE + 0x04u) /* mode select */
#define CAN_BRPR         REGISTER(CAN0_BASE + 0x08u) /* arbitration phase prescaler */
#define CAN_BTR          REGISTER(CAN0_BASE + 0x0Cu)
#define CAN_ISR          REGISTER(CAN0_BASE + 0x1Cu) /* interrupt status: sticky, read without any interrupt */
#define CAN_ICR          REGISTER(CAN0_BASE + 0x24u) /* writing a one clears the ISR bit */
#define CAN_DPBRPR       REGISTER(CAN0_BASE + 0x88u) /* data phase prescaler, transmitter delay compensation */
#define CAN_DPBTR        REGISTER(CAN0_BASE + 0x8Cu)
#define CAN_TRR          REGISTER(CAN0_BASE + 0x90u)             /* transmit request, a bit a buffer */
#define CAN_TCR          REGISTER(CAN0_BASE + 0x98u)             /* cancel request */
#define CAN_AFR          REGISTER(CAN0_BASE + 0xE0u)             /* acceptance filters in use */
#define CAN_FSR          REGISTER(CAN0_BASE + 0xE8u)             /* receive FIFO 0: read index, fill level, increment */
#define CAN_AFMR(n)      REGISTER(CAN0_BASE + 0xA00u + 8u * (n)) /* filter mask */
#define CAN_AFIR(n)      REGISTER(CAN0_BASE + 0xA04u + 8u * (n)) /* filter id */
#define CAN_TX_BUFFER(n) (CAN0_BASE + 0x100u + 0x48u * (n))      /* id, dlc, 16 words of data, first byte on top */
#define CAN_RX_BUFFER(n) (CAN0_BASE + 0x2100u + 0x48u * (n))

enum {
    CAN_SRR_SRST = 1u << 0,
    CAN_SRR_CEN = 1u << 1,
    CAN_MSR_SBR = 1u << 6,     /* start the recovery from bus-off */
    CAN_ISR_RXFOFLW = 1u << 6, /* receive FIFO 0 has lost a frame */
    CAN_ISR_BSOFF = 1u << 9,
    CAN_FSR_IRI = 1u << 7, /* done with the frame at the read index */
    CAN_DPBRPR_TDC = 1u << 16,
    CAN_ID_IDE = 1u << 19, /* 29-bit id */
    CAN_ID_RTR = 1u << 20, /* of a frame with an 11-bit id */
    CAN_DLC_BRS = 1u << 26,
    CAN_DLC_FDF = 1u << 27
};

#endif
