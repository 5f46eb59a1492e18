/* registers: the UART registers of the AMD Versal low-power domain that this board uses (AM012, Versal ACAP register
 * reference). */
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

#endif
