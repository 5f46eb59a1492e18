/* mutant: the declarations that an instrumented source needs. Included before everything else. */
#ifndef MUTANT_H
#define MUTANT_H

extern int mutant_active;
extern unsigned char mutant_reached[];
extern unsigned long long mutant_steps, mutant_limit;
void mutant_hangs(void);

#define MUTANT(number) (mutant_reached[number] = 1, mutant_active == (number))
#define MUTANT_STEP()  ((void)((++mutant_steps > mutant_limit) ? (mutant_hangs(), 0) : 0))

#endif
