/* registers: the registers of the STM32G474 that this board uses, with their section in RM0440 rev 8. */
#ifndef TAUPERP_STM32G4_REGISTERS_H
#define TAUPERP_STM32G4_REGISTERS_H

#include <stdint.h>

/* A function if a test replaces the device by a model. */
#ifdef REGISTER_MODEL
volatile uint32_t *register_model(uint32_t address);
#define REGISTER(address) (*register_model(address))
#else
#define REGISTER(address) (*(volatile uint32_t *)(address))
#endif

/* 7.4 RCC */
#define RCC_CR_ADDRESS   0x40021000u
#define RCC_CFGR_ADDRESS 0x40021008u

#define RCC_CR       REGISTER(RCC_CR_ADDRESS)
#define RCC_CFGR     REGISTER(RCC_CFGR_ADDRESS)
#define RCC_PLLCFGR  REGISTER(0x4002100Cu)
#define RCC_AHB2ENR  REGISTER(0x4002104Cu)
#define RCC_APB1ENR1 REGISTER(0x40021058u)
#define RCC_CCIPR    REGISTER(0x40021088u)
#define RCC_CSR      REGISTER(0x40021094u)

enum {
    RCC_CR_HSEON = 1u << 16,
    RCC_CR_HSERDY = 1u << 17,
    RCC_CR_CSSON = 1u << 19, /* clock security: a crystal that stops is an NMI */
    RCC_CR_PLLON = 1u << 24,
    RCC_CR_PLLRDY = 1u << 25,
    RCC_CFGR_SW_PLL = 3u,
    RCC_CFGR_SWS = 3u << 2,
    RCC_CFGR_SWS_PLL = 3u << 2,
    RCC_CFGR_HPRE = 0xFu << 4,
    RCC_CFGR_HPRE_2 = 8u << 4,
    RCC_PLLCFGR_SOURCE_HSE = 3u,
    RCC_PLLCFGR_M_SHIFT = 4,
    RCC_PLLCFGR_N_SHIFT = 8,
    RCC_PLLCFGR_QEN = 1u << 20,
    RCC_PLLCFGR_Q_4 = 1u << 21,
    RCC_PLLCFGR_REN = 1u << 24, /* R = 2 */
    RCC_AHB2ENR_GPIOA = 1u << 0,
    RCC_APB1ENR1_TIM2 = 1u << 0,
    RCC_APB1ENR1_USART2 = 1u << 17,
    RCC_APB1ENR1_FDCAN = 1u << 25,
    RCC_APB1ENR1_PWR = 1u << 28,
    RCC_CCIPR_FDCAN_PLLQ = 1u << 24,
    RCC_CSR_RMVF = 1u << 23, /* clears the flags below */
    RCC_CSR_OBLRSTF = 1u << 25,
    RCC_CSR_PINRSTF = 1u << 26,
    RCC_CSR_BORRSTF = 1u << 27, /* set at power-on, too */
    RCC_CSR_SFTRSTF = 1u << 28,
    RCC_CSR_IWDGRSTF = 1u << 29,
    RCC_CSR_WWDGRSTF = 1u << 30
};

#define RCC_CSR_LPWRRSTF (1u << 31)

#define FLASH_ACR_ADDRESS 0x40022000u
#define FLASH_ACR         REGISTER(FLASH_ACR_ADDRESS) /* 5.7.1 */
enum { FLASH_ACR_LATENCY = 0xFu, FLASH_ACR_4_WAIT_STATES = 4u };

#define PWR_CR5 REGISTER(0x40007080u) /* 6.4.21 */
enum { PWR_CR5_R1MODE = 1u << 8 };    /* zero: range 1 boost, for more than 150 MHz */

/* 9.4 GPIO */
#define GPIOA_MODER REGISTER(0x48000000u)
#define GPIOA_ODR   REGISTER(0x48000014u)
#define GPIOA_BSRR  REGISTER(0x48000018u)
#define GPIOA_AFRL  REGISTER(0x48000020u)
#define GPIOA_AFRH  REGISTER(0x48000024u)
enum { MODE_OUTPUT = 1u, MODE_ALTERNATE = 2u, MODE_MASK = 3u, ALTERNATE_USART = 7u, ALTERNATE_FDCAN = 9u };

/* 29.5 TIM2, 32 bits wide */
#define TIM2_CR1 REGISTER(0x40000000u)
#define TIM2_EGR REGISTER(0x40000014u)
#define TIM2_CNT REGISTER(0x40000024u)
#define TIM2_PSC REGISTER(0x40000028u)
#define TIM2_ARR REGISTER(0x4000002Cu)
enum { TIM_CR1_CEN = 1u, TIM_EGR_UG = 1u };

/* 42.4 IWDG */
#define IWDG_KR  REGISTER(0x40003000u)
#define IWDG_PR  REGISTER(0x40003004u)
#define IWDG_RLR REGISTER(0x40003008u)
#define IWDG_SR  REGISTER(0x4000300Cu)
enum { IWDG_START = 0xCCCCu, IWDG_UNLOCK = 0x5555u, IWDG_RELOAD = 0xAAAAu, IWDG_RLR_MAX = 0xFFFu };

/* 37.8 USART2 */
#define USART2_CR1 REGISTER(0x40004400u)
#define USART2_BRR REGISTER(0x4000440Cu)
#define USART2_ISR REGISTER(0x4000441Cu)
#define USART2_TDR REGISTER(0x40004428u)
enum { USART_CR1_UE = 1u << 0, USART_CR1_TE = 1u << 3, USART_CR1_FIFOEN = 1u << 29, USART_ISR_TXFNF = 1u << 7 };

/* Armv7-M ARM B3.2 */
#define SCB_CPACR REGISTER(0xE000ED88u)
#define SCB_CFSR  REGISTER(0xE000ED28u)
#define SCB_BFAR  REGISTER(0xE000ED38u)
enum { CPACR_FPU_FULL_ACCESS = 0xFu << 20 };

#endif
