/* The installation's configuration block, byte for byte as `tauperp config` wrote it; behind it that of the second
   channel, if the file has one. */
    .section .tauperp_config, "a", %progbits
    .balign 8
    .global board_config
    .type board_config, %object
board_config:
    .incbin CONFIG_BLOCK
    .size board_config, . - board_config
    .global board_config_end
board_config_end:
