#include "board.h"
#include "loop.h"

/* NOLINTNEXTLINE(misc-use-internal-linkage): startup.S calls it after it has set up the memory */
int main(void);

int main(void) {
    board_init();
    loop_run();
}
