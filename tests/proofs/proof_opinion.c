/* firmware/guard/opinion.c: any two opinions. */
#include "proof.h"

#include "opinion.c"

void proof_opinion_worse(void) {
    opinion_t first, second;
    const opinion_t *const worse = opinion_worse(&first, &second);
    HOLDS((worse == &first) || (worse == &second), "one of both");
    HOLDS((worse->wish <= first.wish) && (worse->wish <= second.wish), "no wish is worse");
    REACHED;
}
