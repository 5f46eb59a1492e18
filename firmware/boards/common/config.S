/* The installation's configuration block, byte for byte as `tauperp config` wrote it, and its CRC for the identity. */
    .section .tauperp_config, "a", %progbits
    .balign 8
    .global board_config
    .type board_config, %object
board_config:
    .incbin CONFIG_BLOCK
    .size board_config, . - board_config
