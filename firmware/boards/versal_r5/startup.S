/* Start-up of the Cortex-R5F: vectors, stacks, FPU, memory; then main. Arm state, system mode, interrupts always off.
 *
 * Every exception is a fault (exceptions.c): it never returns, so it needs no register of the code it ended. */
    .syntax unified
    .arm

    .section .vectors, "ax", %progbits
    .global vectors
vectors:
    ldr pc, =reset
    ldr pc, =undefined_instruction
    ldr pc, =supervisor_call
    ldr pc, =prefetch_abort
    ldr pc, =data_abort
    nop
    ldr pc, =interrupt
    ldr pc, =fast_interrupt
    .ltorg

    .text
    .global reset
    .type reset, %function
reset:
    cpsid aif, #0x1F                /* system mode */
    ldr sp, =linker_stack_top

    mrc p15, 0, r0, c1, c0, 0       /* SCTLR: vectors at 0 (V), exceptions in Arm state (TE), MPU off (M) */
    bic r0, r0, #(1 << 13)
    bic r0, r0, #(1 << 30)
    bic r0, r0, #(1 << 0)
    mcr p15, 0, r0, c1, c0, 0
    isb

    mrc p15, 0, r0, c1, c0, 2       /* CPACR: coprocessors 10 and 11, the FPU */
    orr r0, r0, #(0xF << 20)
    mcr p15, 0, r0, c1, c0, 2
    isb
    mov r0, #(1 << 30)              /* FPEXC.EN; FPSCR: round to nearest, subnormals kept, NaN as they come */
    vmsr fpexc, r0
    mov r0, #0
    vmsr fpscr, r0

    ldr r0, =linker_data_start
    ldr r1, =linker_data_end
    ldr r2, =linker_data_load
1:  cmp r0, r1
    ldrlo r3, [r2], #4
    strlo r3, [r0], #4
    blo 1b

    ldr r0, =linker_bss_start
    ldr r1, =linker_bss_end
    mov r2, #0
2:  cmp r0, r1
    strlo r2, [r0], #4
    blo 2b

    bl mpu_init
    bl main
    b main_returned

/* fault_stop(kind, address, status): exceptions.h has the kinds. */
undefined_instruction:
    mov r0, #1
    b fault
supervisor_call:
    mov r0, #2
    b fault
prefetch_abort:
    mov r0, #3
    b fault
data_abort:
    mov r0, #4
    b fault
interrupt:
    mov r0, #5
    b fault
fast_interrupt:
    mov r0, #6
fault:
    mov r1, lr
    mrs r2, spsr
    cpsid aif, #0x1F
    ldr sp, =linker_fault_stack_top
    b fault_stop
