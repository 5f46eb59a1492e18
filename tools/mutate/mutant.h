/* mutant: the declarations that an instrumented source needs. Included before everything else.
 *
 * Each macro evaluates an expression once, notes which of its mutants would change its value here, and gives the value
 * of the active mutant. A mutant that changes no value in a test cannot fail that test.
 */
#ifndef MUTANT_H
#define MUTANT_H

extern int mutant_active;
extern unsigned char mutant_reached[]; /* by number: it would have changed the value of its expression */
extern unsigned long long mutant_steps, mutant_limit;
void mutant_hangs(void);

/* MUTANT_QUIET: without notes, three times as fast. */
#ifdef MUTANT_QUIET
#define MUTANT_NOTE(number, change) ((void)0)
#else
#define MUTANT_NOTE(number, change) (mutant_reached[number] |= ((change) ? 1 : 0))
#endif
#define MUTANT(number) (MUTANT_NOTE(number, 1), mutant_active == (number))
#define MUTANT_STEP()  ((void)((++mutant_steps > mutant_limit) ? (mutant_hangs(), 0) : 0))

/* A condition that is always 1 or always 0. */
#define MUTANT_CONDITION(one, zero, condition)                                                                         \
    __extension__({                                                                                                    \
        const int o_ = (condition) ? 1 : 0;                                                                            \
        MUTANT_NOTE(one, !o_);                                                                                         \
        MUTANT_NOTE(zero, o_);                                                                                         \
        (mutant_active == (one)) ? 1 : ((mutant_active == (zero)) ? 0 : o_);                                           \
    })

/* `larger` is the right operand with its constant increased; number 0 where it has none. `matters`: the values that the
 * comparison chooses from differ. */
#define MUTANT_COMPARISON(other, one, zero, constant, left, operator, replacement, right, larger, matters)             \
    __extension__({                                                                                                    \
        const __auto_type l_ = left;                                                                                   \
        const __auto_type r_ = right;                                                                                  \
        const int o_ = (l_ operator r_) ? 1 : 0;                                                                       \
        const int a_ = (l_ replacement r_) ? 1 : 0;                                                                    \
        const int c_ = ((constant) != 0) ? ((l_ operator larger) ? 1 : 0) : 0;                                         \
        MUTANT_NOTE(other, (o_ != a_) && (matters));                                                                   \
        MUTANT_NOTE(one, !o_ && (matters));                                                                            \
        MUTANT_NOTE(zero, o_ && (matters));                                                                            \
        MUTANT_NOTE(constant, ((constant) != 0) && (o_ != c_) && (matters));                                           \
        (mutant_active == 0)            ? o_                                                                           \
        : (mutant_active == (other))    ? a_                                                                           \
        : (mutant_active == (one))      ? 1                                                                            \
        : (mutant_active == (zero))     ? 0                                                                            \
        : (mutant_active == (constant)) ? c_                                                                           \
                                        : o_;                                                                          \
    })

/* `differs` says of the operands l_ and r_ whether the replacement has another result. */
#define MUTANT_ARITHMETIC(number, left, operator, replacement, right, differs)                                         \
    __extension__({                                                                                                    \
        const __auto_type l_ = left;                                                                                   \
        const __auto_type r_ = right;                                                                                  \
        MUTANT_NOTE(number, differs);                                                                                  \
        (mutant_active == (number)) ? (l_ replacement r_) : (l_ operator r_);                                          \
    })

/* && with || as its mutant, and the reverse. The right operand has no effect and cannot trap. */
#define MUTANT_AND(number, left, right, unused)                                                                        \
    __extension__({                                                                                                    \
        const int l_ = left ? 1 : 0;                                                                                   \
        const int r_ = right ? 1 : 0;                                                                                  \
        MUTANT_NOTE(number, l_ != r_);                                                                                 \
        (mutant_active == (number)) ? (l_ | r_) : (l_ & r_);                                                           \
    })
#define MUTANT_OR(number, left, right, unused)                                                                         \
    __extension__({                                                                                                    \
        const int l_ = left ? 1 : 0;                                                                                   \
        const int r_ = right ? 1 : 0;                                                                                  \
        MUTANT_NOTE(number, l_ != r_);                                                                                 \
        (mutant_active == (number)) ? (l_ & r_) : (l_ | r_);                                                           \
    })

/* The same where the right operand may only be evaluated after the left one. `again` is its unchanged text. */
#define MUTANT_AND_LAZY(number, left, right, again)                                                                    \
    __extension__({                                                                                                    \
        const int l_ = left ? 1 : 0;                                                                                   \
        const int r_ = l_ ? ((mutant_active == (number)) ? 1 : (right ? 1 : 0))                                        \
                          : ((mutant_active == (number)) ? (again ? 1 : 0) : 0);                                       \
        MUTANT_NOTE(number, !l_ || !r_);                                                                               \
        r_;                                                                                                            \
    })
#define MUTANT_OR_LAZY(number, left, right, again)                                                                     \
    __extension__({                                                                                                    \
        const int l_ = left ? 1 : 0;                                                                                   \
        const int r_ = l_ ? ((mutant_active == (number)) ? (again ? 1 : 0) : 1)                                        \
                          : ((mutant_active == (number)) ? 0 : (right ? 1 : 0));                                       \
        MUTANT_NOTE(number, l_ || r_);                                                                                 \
        r_;                                                                                                            \
    })

#endif
