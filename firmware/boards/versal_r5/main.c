#include "board.h"
#include "loop.h"

int main(void);

int main(void) {
    board_init();
    loop_run();
}
