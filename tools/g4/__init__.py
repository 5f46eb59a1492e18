"""The NUCLEO-G474RE in Unicorn: runs the image of board stm32g4 as it is flashed (README.md)."""
